#!/bin/bash
# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds a Debian trixie system with Blender 4.3 and a virtual X server (1.2 GB, 2 to 4 minutes), once, outside the tree:
# the machine's own Blender is too old or missing, and a chroot changes nothing on it. Prints the folder; needs root.
# WILDCAP_BLENDER_ROOT names the folder; a complete one is used again.
set -euo pipefail

root=${WILDCAP_BLENDER_ROOT:-/var/tmp/wildcap-blender}
packages=ca-certificates,blender,python3-numpy,xvfb,xauth,x11-utils,imagemagick,libgl1-mesa-dri,libgl1,libegl1

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
unshare --mount --propagation private mmdebstrap --mode=root --variant=apt --quiet \
    --aptopt='APT::Install-Recommends "false"' --aptopt='Acquire::Retries "3"' \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='force-unsafe-io' \
    --include="$packages" trixie "$root.part" "$mirror" >&2
mv "$root.part" "$root"
printf '%s\n' "$packages" > "$root/complete"
echo "$root"
