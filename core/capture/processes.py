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

QUERY_LIMITED_INFORMATION, ACCESS_DENIED, STILL_ACTIVE = 0x1000, 5, 259
"""Of Windows: the right to ask a process when it began, the error of who does not have it, and the exit code of a
process that runs."""


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
    began = process.get("began")
    return not _runs(process["pid"]) or bool(began) and _began(process["pid"]) not in ("", began)


def is_at_work(process: dict) -> bool:
    """Whether a process runs beside us and has not been stopped: then it is awake when we are."""
    name, _, space = _place(process)
    if name != socket.gethostname() or space not in ("", _place({"host": name_host()})[2]) or is_gone(process):
        return False
    if process.get("began") and not _began(process["pid"]):
        return False  # of another user, whose processes are not told: the number may have gone to another
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{process['pid']}/stat").read_bytes().rpartition(b") ")[2][:1] not in (b"T", b"t")
    return True


def _place(process: dict) -> tuple[str, str, str]:
    """Name, run and space of a process's host; '' for what is not told."""
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
        return _ask_windows(pid)[0]
    with contextlib.suppress(OSError, IndexError):
        # Linux: clock ticks since the machine was started
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2].split()[19].decode()
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        # in the same words for every program that asks, whatever its language and time zone
        completed = subprocess.run(
            ["ps", "-o", "lstart=", "-p", str(pid)],
            capture_output=True,
            text=True,
            timeout=5,
            env={**os.environ, "LC_ALL": "C", "TZ": "UTC"},
        )
        return completed.stdout.strip()
    return ""


def _ask_windows(pid: int) -> tuple[str, bool]:
    """When a process of this machine began, '' where that is not told, and whether it runs. One that has ended is there
    for as long as somebody holds a handle of it, as Blender does of its worker; one of another user may not be asked
    and does run."""
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
        told = kernel.GetProcessTimes(handle, *map(ctypes.byref, times))
        runs = not kernel.GetExitCodeProcess(handle, ctypes.byref(code)) or code.value == STILL_ACTIVE
        return f"{times[0].dwHighDateTime}:{times[0].dwLowDateTime}" if told else "", runs
    finally:
        kernel.CloseHandle(handle)


def _runs(pid: int) -> bool:
    if not isinstance(pid, int) or pid <= 0:  # to the system, all processes or a group of them
        return False
    if os.name == "nt":
        return _ask_windows(pid)[1]
    try:
        with contextlib.suppress(PermissionError):
            os.kill(pid, 0)
    except (ProcessLookupError, OverflowError, TypeError, ValueError):
        return False
    # Linux: a process that has ended, but that nobody has asked after, as in a container without an init
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2][:1] != b"Z"
    return True
