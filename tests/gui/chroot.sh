#!/bin/bash
# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds a Debian system with Blender and a virtual X server (1.2 GB, 2 to 4 minutes), once, outside the tree: the machine's
# own Blender is too old or missing, and a chroot changes nothing on it. Prints the folder; needs root.
# Argument: trixie (Blender 4.3, the default), or sid for the newest Blender that Debian has, which changes from week to week.
# WILDCAP_BLENDER_ROOT names the folder of trixie's, and sid's is named after it; a complete one is used again.
set -euo pipefail

release=${1:-trixie}
root=${WILDCAP_BLENDER_ROOT:-/var/tmp/wildcap-blender}
packages=ca-certificates,blender,python3-numpy,xvfb,xauth,x11-utils,imagemagick,libgl1-mesa-dri,libgl1,libegl1
options=()
if [ "$release" = sid ]; then
    root=$root-sid
    packages=$packages,python3-cattr,python3-requests  # without which its list of extensions fails; its package does not ask for them
    options=(--aptopt='Acquire::Check-Valid-Until "false"')  # a mirror may be some days behind; what it has is signed all the same
fi

if [ "$(id -u)" != 0 ]; then
    echo "To build and to enter a system with Blender needs root." >&2
    exit 1
fi
if [ -e "$root/complete" ] && [ "$(cat "$root/complete")" = "$packages" ]; then
    echo "$root"
    exit 0
fi

# The Debian mirror that this machine's apt uses, so that a site's own mirror is honoured.
mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list 2>/dev/null |
    grep -oE '(https?|mirror\+file)://[^ ]+/debian/?( |$)' | head -n 1 | tr -d ' ' || true)
if [ -z "$mirror" ]; then
    echo "No Debian mirror is named in this machine's apt sources: run this on Debian, or add one there." >&2
    exit 1
fi

if ! command -v mmdebstrap > /dev/null; then
    apt-get update -qq >&2
    apt-get install -y -qq --no-install-recommends mmdebstrap >&2
fi

rm -rf --one-file-system "$root" "$root.part"
mkdir -p "$(dirname "$root")"
trap 'rm -rf --one-file-system "$root.part"' EXIT
unshare --mount --propagation private mmdebstrap --mode=root --variant=apt "${options[@]}" \
    --aptopt='APT::Install-Recommends "false"' --aptopt='Acquire::Retries "3"' \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='force-unsafe-io' \
    --include="$packages" "$release" "$root.part" "$mirror" >&2
mv "$root.part" "$root"
printf '%s\n' "$packages" > "$root/complete"
echo "$root"
