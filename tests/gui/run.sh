#!/bin/bash
# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
# The tests in a real Blender window: builds the chroot if need be, enters it with the checkout, the newest zip in dist/ and
# the worker's Python mounted where they are outside, and runs suite.py. The mounts live in a namespace of their own.
# Screenshots and logs: dist/gui/. Arguments: names of flows to run (default: all); --newest before them takes Debian sid's
# Blender, with dist/gui/newest/.
set -euo pipefail
cd "$(dirname "$0")/../.."

checkout=$PWD
release=trixie
out=dist/gui
if [ "${1:-}" = --newest ]; then
    release=sid
    out=dist/gui/newest
    shift
fi
root=$(tests/gui/chroot.sh $release)
zip=$(ls -t dist/wildcap-*.zip | head -n 1)
mkdir -p $out

# What the venv's Python needs from outside: its standard library and executable, wherever the venv points to.
mapfile -t mounts < <(.venv/bin/python - <<'PYTHON'
import os, sys, sysconfig
real = os.path.realpath(sys.executable)
print(*dict.fromkeys([os.path.dirname(real), sysconfig.get_path("stdlib")] if sys.base_prefix == "/usr" else [sys.base_prefix]), sep="\n")
PYTHON
)
if [ "${mounts[0]}" = /usr/bin ]; then
    mounts[0]=$(readlink -f .venv/bin/python)  # of /usr/bin the one file: the rest is the chroot's own
fi

# For the flow set_up, which installs the solver: a Python to begin with, pip's own variables, and whatever paths the caller names.
base=$(.venv/bin/python -c 'import sys; print(sys.base_prefix)')
IFS=: read -ra named <<< "${WILDCAP_MOUNTS:-}"
mounts+=("${named[@]}")

export root checkout zip base out
exec unshare --mount --pid --fork --kill-child --propagation private bash -c '
    set -euo pipefail
    mount -t proc proc "$root/proc"
    mount --rbind /sys "$root/sys"
    mount --rbind /dev "$root/dev"
    mount -t tmpfs tmpfs "$root/tmp"
    mount -t tmpfs tmpfs "$root/home"
    chroot="$root"
    for path in "$checkout" "$@"; do
        [ "$path" = -- ] && break
        [ -n "$path" ] || continue
        if [ -d "$path" ]; then mkdir -p "$chroot$path"; else mkdir -p "$(dirname "$chroot$path")"; touch "$chroot$path"; fi
        mount --bind "$path" "$chroot$path"
    done
    while [ "$1" != -- ]; do shift; done
    shift
    mapfile -t pip < <(env | grep -E "^(PIP_|SSL_CERT_)")
    exec chroot "$chroot" env -i "${pip[@]}" PATH="/usr/bin:/bin:$base/bin" HOME=/root LANG=C.UTF-8 LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe \
        python3 -B "$checkout/tests/gui/suite.py" "$checkout/$zip" "$checkout/$out" "$@"
' run "${mounts[@]}" -- "$@"
