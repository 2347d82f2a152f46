# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks in memory that only this process and its children see, small enough to be full.

Linux only: mount namespaces (unshare(2), user_namespaces(7)) and tmpfs(5).
"""

import contextlib
import ctypes
import os
import sys
from pathlib import Path

NEW_MOUNTS, NEW_USER = 0x00020000, 0x10000000  # CLONE_NEWNS, CLONE_NEWUSER
PRIVATE, REMOUNT, DETACH = 0x4000 | 0x40000, 0x20, 0x2  # MS_REC | MS_PRIVATE, MS_REMOUNT, MNT_DETACH


def go_private() -> bool:
    """Give this process mounts of its own; False if the system does not allow it. Call it before any thread starts."""
    if not sys.platform.startswith("linux"):
        return False
    user, group = os.getuid(), os.getgid()
    try:
        _call("unshare", NEW_MOUNTS if user == 0 else NEW_MOUNTS | NEW_USER)
        if user:
            maps = {"setgroups": "deny", "uid_map": f"{user} {user} 1", "gid_map": f"{group} {group} 1"}
            for name, text in maps.items():
                Path(f"/proc/self/{name}").write_text(text, encoding="ascii")
        _call("mount", b"none", b"/", None, PRIVATE, None)
    except OSError:
        return False
    return True


def mount(folder: Path, size: int) -> None:
    """Mount an empty disk of `size` bytes at a folder."""
    _call("mount", b"tmpfs", bytes(folder), b"tmpfs", 0, f"size={size}".encode())


def resize(folder: Path, size: int) -> None:
    """Give a disk of `mount` another size."""
    _call("mount", b"tmpfs", bytes(folder), b"tmpfs", REMOUNT, f"size={size}".encode())


def unmount(folder: Path) -> None:
    with contextlib.suppress(OSError):  # it was none
        _call("umount2", bytes(folder), DETACH)


def _call(name: str, *arguments) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    typed = [ctypes.c_ulong(value) if name == "mount" and isinstance(value, int) else value for value in arguments]
    if getattr(libc, name)(*typed) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), name)
