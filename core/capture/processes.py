# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Identify processes by host, number and beginning, so that none is mistaken for another.

A process number alone is reused sooner or later, and after a restart of the machine at once.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
from functools import cache
from pathlib import Path

QUERY_LIMITED_INFORMATION, ACCESS_DENIED, STILL_ACTIVE = 0x1000, 5, 259
"""Of Windows: the right to query a process, the error without it, and the exit code of a running process."""


@cache
def name_host() -> str:
    """Return NAME/RUN/SPACE: the machine's name and, if available, the ids of its boot and of the process namespace.

    Containers on one machine have process numbers of their own.
    """
    run = space = ""
    with contextlib.suppress(OSError):
        run = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()[:8]
    with contextlib.suppress(OSError):
        space = os.readlink("/proc/self/ns/pid").strip("pid:[]")
    return f"{socket.gethostname()}/{run}/{space}"


def identify_process() -> dict:
    """Return this process as files record it: {"host", "pid", "began"}."""
    return {"host": name_host(), "pid": os.getpid(), "began": _began(os.getpid())}


def is_gone(process: dict) -> bool:
    """Return whether a process has certainly ended; one of another machine or container cannot be checked."""
    (name, run, space), (our_name, our_run, our_space) = _split(process.get("host")), _split(name_host())
    if name != our_name:
        return False
    if run and run != our_run:
        return True  # the machine was restarted
    if space and space != our_space:
        return False
    began = process.get("began")
    return not _runs(process["pid"]) or bool(began) and _began(process["pid"]) not in ("", began)


def is_at_work(process: dict) -> bool:
    """Return whether a process runs beside us and is not stopped."""
    (name, _, space), (our_name, _, our_space) = _split(process.get("host")), _split(name_host())
    if name != our_name or space not in ("", our_space) or is_gone(process):
        return False
    if process.get("began") and not _began(process["pid"]):
        return False  # hidden, of another user: the number may be another process's
    with contextlib.suppress(OSError, IndexError):
        return _read_stat(process["pid"])[0] not in (b"T", b"t")
    return True


def _split(host) -> list[str]:
    """Split NAME/RUN/SPACE; '' for unknown parts."""
    return (str(host).split("/", 2) + ["", ""])[:3]


def _began(pid: int) -> str:
    """Return when a process of this machine began, in the system's own form, or ''."""
    return _own_beginning(pid) if pid == os.getpid() else _ask_beginning(pid)


@cache
def _own_beginning(pid: int) -> str:
    return _ask_beginning(pid)


def _ask_beginning(pid: int) -> str:
    if os.name == "nt":
        return _ask_windows(pid)[0]
    with contextlib.suppress(OSError, IndexError):
        return _read_stat(pid)[19].decode()  # clock ticks since the boot
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        completed = subprocess.run(
            ["ps", "-o", "lstart=", "-p", str(pid)],
            capture_output=True,
            text=True,
            timeout=5,
            env={**os.environ, "LC_ALL": "C", "TZ": "UTC"},  # the same text in every language and time zone
        )
        return completed.stdout.strip()
    return ""


def _read_stat(pid: int) -> list[bytes]:
    """Return the fields of Linux's /proc/PID/stat from the state on. Raises OSError on other systems."""
    return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2].split()


def _ask_windows(pid: int) -> tuple[str, bool]:
    """Return when a process of this machine began, or '', and whether it runs.

    An ended one exists while somebody holds a handle, as Blender does of its worker; one of another user runs.
    """
    import ctypes
    from ctypes import wintypes

    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    kernel.OpenProcess.restype = wintypes.HANDLE
    kernel.OpenProcess.argtypes = wintypes.DWORD, wintypes.BOOL, wintypes.DWORD
    handle = kernel.OpenProcess(QUERY_LIMITED_INFORMATION, False, pid)
    if not handle:
        return "", ctypes.get_last_error() == ACCESS_DENIED
    handle, code, times = wintypes.HANDLE(handle), wintypes.DWORD(), [wintypes.FILETIME() for _ in range(4)]
    try:
        dated = kernel.GetProcessTimes(handle, *map(ctypes.byref, times))
        runs = not kernel.GetExitCodeProcess(handle, ctypes.byref(code)) or code.value == STILL_ACTIVE
        return f"{times[0].dwHighDateTime}:{times[0].dwLowDateTime}" if dated else "", runs
    finally:
        kernel.CloseHandle(handle)


def _runs(pid: int) -> bool:
    if not isinstance(pid, int) or pid <= 0:  # kill(2) would mean a group of processes
        return False
    if os.name == "nt":
        return _ask_windows(pid)[1]
    try:
        with contextlib.suppress(PermissionError):
            os.kill(pid, 0)
    except (ProcessLookupError, OverflowError, TypeError, ValueError):
        return False
    with contextlib.suppress(OSError, IndexError):
        return _read_stat(pid)[0] != b"Z"  # a zombie has ended, as in a container without an init
    return True
