# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which process works somewhere, told so that nothing else is ever taken for it: its host since that was started, its
number, and when it began.

Standard library only. A process number alone is given to another process sooner or later, and after a restart of the
machine at once.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
from functools import cache
from pathlib import Path


@cache
def name_host() -> str:
    """NAME/RUN/SPACE: this machine's name and, where it tells them, the identity of its present run and of the space in
    which processes have numbers (containers of one machine have their own)."""
    run = space = ""
    with contextlib.suppress(OSError):
        run = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()[:8]
    with contextlib.suppress(OSError):
        space = os.readlink("/proc/self/ns/pid").strip("pid:[]")
    return f"{socket.gethostname()}/{run}/{space}"


def identify_process() -> dict:
    """This process as a file holds it: {"host", "pid", "began"}."""
    return {"host": name_host(), "pid": os.getpid(), "began": _began(os.getpid())}


def is_gone(process: dict) -> bool:
    """Whether a process is certainly not running any more. One of another machine or container may be: only those
    beside us can be asked after."""
    name, run, space = _place(process)
    _, our_run, our_space = _place({"host": name_host()})
    if name != socket.gethostname():
        return False
    if run and run != our_run:
        return True  # this machine has been started again since
    if space and space != our_space:
        return False
    return not _runs(process["pid"]) or (bool(process.get("began")) and process["began"] != _began(process["pid"]))


def is_at_work(process: dict) -> bool:
    """Whether a process runs beside us and has not been stopped: then it is awake when we are."""
    name, _, space = _place(process)
    if name != socket.gethostname() or space not in ("", _place({"host": name_host()})[2]) or is_gone(process):
        return False
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{process['pid']}/stat").read_bytes().rpartition(b") ")[2][:1] not in (b"T", b"t")
    return True


def _place(process: dict) -> tuple[str, str, str]:
    """Name, run and space of a process's host; '' for what is not told, as by WildCap 0.1.0."""
    name, _, rest = str(process.get("host")).partition("/")
    run, _, space = rest.partition("/")
    return name, run, space


def _began(pid: int) -> str:
    """When a process of this machine began, in whatever form the system tells it; '' where it does not."""
    if pid == os.getpid():
        return _own_beginning(pid)
    return _ask_beginning(pid)


@cache
def _own_beginning(pid: int) -> str:
    return _ask_beginning(pid)


def _ask_beginning(pid: int) -> str:
    if os.name == "nt":
        return _windows_beginning(pid)
    with contextlib.suppress(OSError, IndexError):
        # Linux: clock ticks since the machine was started
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2].split()[19].decode()
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        # in the same words for every program that asks, whatever its language and time zone
        completed = subprocess.run(["ps", "-o", "lstart=", "-p", str(pid)], capture_output=True, text=True, timeout=5,
                                   env={**os.environ, "LC_ALL": "C", "TZ": "UTC"})
        return completed.stdout.strip()
    return ""


def _windows_beginning(pid: int) -> str:
    import ctypes
    from ctypes import wintypes

    handle = ctypes.windll.kernel32.OpenProcess(0x1000, False, pid)  # PROCESS_QUERY_LIMITED_INFORMATION
    if not handle:
        return ""
    times = [wintypes.FILETIME() for _ in range(4)]
    try:
        told = ctypes.windll.kernel32.GetProcessTimes(handle, *map(ctypes.byref, times))
        return f"{times[0].dwHighDateTime}:{times[0].dwLowDateTime}" if told else ""
    finally:
        ctypes.windll.kernel32.CloseHandle(handle)


def _runs(pid: int) -> bool:
    if os.name == "nt":
        return bool(_windows_beginning(pid))
    try:
        with contextlib.suppress(PermissionError):
            os.kill(pid, 0)
    except (ProcessLookupError, OverflowError, TypeError, ValueError):
        return False
    # Linux: a process that has ended, but that nobody has asked after, as in a container without an init
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2][:1] != b"Z"
    return True
