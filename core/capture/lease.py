# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lock of a capture: a lease, which its holder refreshes and which another may take once it has seen no refresh for
a whole term.

The file `lock` is made with O_EXCL, which every file system has; hard links some have not. It names the process that
holds it and a token of its own, and its time of change is the refresh: who waits only looks whether that changes, by a
clock of their own, for clocks of two machines differ. A holder that was asleep and has been replaced finds another
token in the file, and every write into the capture asks for that first. Standard library only.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from .messages import CancelledError, Problem
from .processes import identify_process, is_at_work, is_gone
from .regular_files import require_regular

TERM_S = 30.0
"""How long a lease lasts without a refresh. A refresh that is held up for longer costs its holder the lease, and nobody
a file; a shorter term would make that more frequent, a longer one has an artist wait longer for a machine that has
gone."""
REFRESHES = 5
"""How often it is refreshed in one term."""
LOOK_S = 0.1
SUCCESSION = ".succeeding"
"""Ending of the file that keeps two who found the same lease expired from both taking it."""
_held: dict[str, Lease] = {}  # lock -> the lease that this process holds


@dataclass(frozen=True)
class Lease:
    """One holder's claim on a capture: the file and the token that must stand in it."""

    path: Path
    token: str

    def holds(self) -> bool:
        """Whether nobody has taken it over. Raises OSError where the disk does not tell just now."""
        try:
            return _parse(self.path).get("token") == self.token
        except FileNotFoundError:
            return False


def check_lease(root: Path) -> None:
    """Raises Problem where this process had the capture and another one took it over while this one was asleep: it may
    write nothing more."""
    lease = _held.get(_key(root / "lock"))
    if lease is not None and not lease.holds():
        raise Problem(
            "Another worker has taken this capture over while this one was asleep; nothing more was written here.",
            "Look at what the other one does, and run again when it has ended: finished stages are kept.",
        )


def holder(path: Path) -> dict | None:
    """Who holds the lease in the file `path`, as far as can be told at once: None where nobody does, or a process that
    has ended."""
    _refuse_stranger(path)
    lease_holder = _read(path)
    return None if lease_holder is None or lease_holder and is_gone(lease_holder) else lease_holder


def seems_expired(holder: dict, path: Path) -> bool:
    """Whether the lease that `holder` has in the file `path` was not refreshed for a term, by the clock that the disk
    gives a new file beside it. That may not be the clock of its holder: who takes it over still waits (hold)."""
    if holder and is_at_work(holder):
        return False
    with contextlib.suppress(OSError), tempfile.TemporaryFile(dir=path.parent) as new:
        return os.fstat(new.fileno()).st_mtime - path.stat().st_mtime > TERM_S
    return False


def present_holder(path: Path) -> dict | None:
    """As `holder`, and None where its lease seems expired: what a machine that has gone left is no obstacle."""
    lease_holder = holder(path)
    return None if lease_holder is None or seems_expired(lease_holder, path) else lease_holder


def refuse(holder: dict, path: Path, folder_kind: str = "capture") -> Problem:
    """The Problem of a capture, or a batch, that is worked on."""
    if not holder:
        return Problem(
            f"Another worker is just beginning to work on this {folder_kind}.",
            f"Wait a moment and try again; if nobody works on it, delete {path}.",
        )
    return Problem(
        f"Another worker (process {holder['pid']} on {str(holder['host']).partition('/')[0]}, since "
        f"{holder['since']}) is working on this {folder_kind}.",
        f"Wait for it or cancel it there; if it is gone, delete {path}.",
    )


def _refuse_stranger(path: Path) -> None:
    """Raises Problem for a link, a folder or a pipe under the lock's name, which no worker has put there and none can
    give back."""
    if path.is_symlink() or path.exists() and not path.is_file():
        raise Problem(f"{path} is in the way: it is not one of WildCap's locks.", "Move it away, or delete it.")


def hold(
    root: Path,
    tell: Callable[[str], None] = lambda text: None,
    folder_kind: str = "capture",
    cancelled: Callable[[], bool] = lambda: False,
) -> contextlib.AbstractContextManager[Lease]:
    """Holds the lease of a capture's folder, or a batch's, which must be there: `hold_file` of its lock."""
    return hold_file(root / "lock", tell, folder_kind, cancelled)


@contextlib.contextmanager
def hold_file(
    path: Path,
    tell: Callable[[str], None] = lambda text: None,
    folder_kind: str = "capture",
    cancelled: Callable[[], bool] = lambda: False,
) -> Iterator[Lease]:
    """Holds the lease whose file is `path`, in a folder that must be there.

    A process of this machine that is at work is refused at once, and one that has ended is replaced at once. For one
    that was stopped, or that lives on another machine, a term is waited for a refresh.

    Parameters
    ----------
    path : of the lock
    tell : hears of the wait
    folder_kind : "capture", "batch" or another word for what is worked on, for the Problem
    cancelled : whether the wait is to end

    Raises
    ------
    Problem
        Naming who works there.
    CancelledError
        Where `cancelled` says so.
    """
    lease = Lease(path, secrets.token_hex(8))
    while not _make(lease):
        expired = _wait_out(lease.path, tell, folder_kind, cancelled)
        if expired is not None:
            _take_over(lease, *expired)
    _held[_key(path)] = lease
    _clear_asides(lease.path)
    ended = threading.Event()
    keeper = threading.Thread(target=_refresh, args=(lease, ended), name="wildcap-lease", daemon=True)
    keeper.start()
    try:
        yield lease
    finally:
        ended.set()
        keeper.join()
        del _held[_key(path)]
        with contextlib.suppress(OSError):  # a server that has gone: the lease runs out
            if lease.holds():
                lease.path.unlink(missing_ok=True)


def _make(lease: Lease) -> bool:
    """Makes the file, in one step with its content but for the moment in between, in which it is empty and counts as
    being made."""
    content = {**identify_process(), "since": time.strftime("%Y-%m-%dT%H:%M:%S"), "token": lease.token}
    try:
        descriptor = os.open(lease.path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    except FileExistsError:
        return False
    try:
        with open(descriptor, "wb") as file:
            file.write(json.dumps(content).encode())
    except OSError:  # an empty one on a full disk would be taken for somebody who is just beginning
        with contextlib.suppress(OSError):
            lease.path.unlink()
        raise
    return True


def _wait_out(
    path: Path, tell: Callable[[str], None], folder_kind: str, cancelled: Callable[[], bool]
) -> tuple[dict, tuple | None] | None:
    """What the lease says that can be taken over, and its stamp: its holder has ended, or a term went by without a
    refresh. None where it was given back. Raises Problem when it is held, and CancelledError."""
    _refuse_stranger(path)
    first, began, told = _stamp(path), time.monotonic(), False
    while True:
        lease_holder = _read(path)
        if lease_holder is None or lease_holder and is_gone(lease_holder):
            return None if lease_holder is None else (lease_holder, first)
        if _stamp(path) != first or lease_holder and is_at_work(lease_holder):
            raise refuse(_read(path) or lease_holder, path, folder_kind)
        waited = time.monotonic() - began
        if waited > TERM_S:
            return lease_holder, first
        if waited > 1 and not told:
            tell(f"Looking whether the worker that holds this {folder_kind} is still at work ...")
            told = True
        if cancelled():
            raise CancelledError(str(path))
        time.sleep(LOOK_S)


def _take_over(lease: Lease, expired: dict, stamp: tuple | None) -> None:
    """Removes the lease that said `expired`, unless somebody was faster. Only one at a time may: the file beside it
    keeps the others out."""
    path = lease.path
    succession = Lease(path.with_name(path.name + SUCCESSION), lease.token)
    if not _make(succession):
        _clear(succession.path)
        return
    try:
        if _read(path) == expired and _stamp(path) == stamp:
            aside = path.with_name(f"{path.name}.{lease.token}")
            with contextlib.suppress(FileNotFoundError):
                os.rename(path, aside)
                # the old holder awoke, gave it back, and somebody else has it since
                if _read(aside) != expired and not path.exists():
                    os.rename(aside, path)
                aside.unlink(missing_ok=True)
    finally:
        succession.path.unlink(missing_ok=True)


def _clear(succession: Path) -> None:
    """Waits a moment for whoever is taking the lease over; removes what one that was killed in the middle of it has
    left."""
    lease_holder, stamp, began = _read(succession), _stamp(succession), time.monotonic()
    while _stamp(succession) == stamp and stamp is not None:
        if lease_holder and is_gone(lease_holder) or time.monotonic() - began > TERM_S:
            succession.unlink(missing_ok=True)
            return
        time.sleep(LOOK_S / 10)


def _clear_asides(path: Path) -> None:
    """Removes what one that was killed while it took a lease over has left beside it, of processes that have ended."""
    for left in path.parent.glob(f"{path.name}.*"):
        lease_holder = _read(left)
        if lease_holder and is_gone(lease_holder):
            left.unlink(missing_ok=True)


def _refresh(lease: Lease, ended: threading.Event) -> None:
    while not ended.wait(TERM_S / REFRESHES):
        with contextlib.suppress(OSError):
            if not lease.holds():
                return
            os.utime(lease.path)


def _read(path: Path) -> dict | None:
    """What the file says; {} where it is empty, half written or cannot be read, None where it is not there."""
    try:
        return _parse(path)
    except FileNotFoundError:
        return None
    except OSError:
        return {}


def _parse(path: Path) -> dict:
    """What the file says; {} where it is empty or half written. Raises OSError where it cannot be read."""
    try:
        content = json.loads(require_regular(path).read_bytes())
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) and {"host", "pid", "since"} <= content.keys() else {}


def _stamp(path: Path) -> tuple | None:
    try:
        info = path.stat()
    except FileNotFoundError:
        return None
    return info.st_mtime_ns, info.st_size, info.st_ino


def _key(path: Path) -> str:
    return os.path.abspath(path)
