# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lock of a capture: a lease that another worker may take over after a term without a refresh.

The file `lock` is made with O_EXCL, which every file system has. It names the holding process and a token; its time of
change is the refresh. Whoever waits only watches whether that changes, by its own clock, because clocks of two machines
differ. A holder that slept and was replaced finds another token, and every write into the capture checks that first.
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
"""Duration of a lease without a refresh. A shorter term replaces slow holders more often, a longer one has an artist
wait longer for a machine that has gone."""
REFRESHES = 5
"""Refreshes per term."""
LOOK_S = 0.1
SUCCESSION = ".succeeding"
"""Suffix of the file that keeps two processes from both taking over one expired lease."""
_held: dict[str, Lease] = {}  # lock -> lease of this process


@dataclass(frozen=True)
class Lease:
    """One holder's claim: the lock file, and the token that it must contain."""

    path: Path
    token: str

    def holds(self) -> bool:
        """Return whether nobody has taken it over. Raises OSError if the disk does not answer."""
        try:
            return _parse(self.path).get("token") == self.token
        except FileNotFoundError:
            return False


def check_lease(root: Path) -> None:
    """Raise Problem if another process took over a capture that this one held."""
    lease = _held.get(os.path.abspath(root / "lock"))
    if lease is not None and not lease.holds():
        raise Problem(
            "Another worker has taken this capture over while this one was asleep; nothing more was written here.",
            "Wait until the other one has ended, then run again: finished stages are kept.",
        )


def holder(path: Path) -> dict | None:
    """Return the holder that a lock file names, or None for nobody or an ended process."""
    _refuse_stranger(path)
    content = _read(path)
    return None if content and is_gone(content) else content


def present_holder(path: Path) -> dict | None:
    """Return the `holder`, or None if its lease seems to have expired: a machine that has gone is no obstacle."""
    content = holder(path)
    return None if content is None or _seems_expired(content, path) else content


def _seems_expired(holder: dict, path: Path) -> bool:
    """Return whether a lease was not refreshed for a term by the disk's clock, as a new file beside it shows.

    That may not be the holder's clock: whoever takes it over still waits (hold_file).
    """
    if holder and is_at_work(holder):
        return False
    with contextlib.suppress(OSError), tempfile.TemporaryFile(dir=path.parent) as new:
        return os.fstat(new.fileno()).st_mtime - path.stat().st_mtime > TERM_S
    return False


def refuse(holder: dict, path: Path, folder_kind: str = "capture") -> Problem:
    """Return the Problem of a capture or batch that another worker holds."""
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
    """Raise Problem for a link, a folder or a pipe in place of the lock."""
    if path.is_symlink() or path.exists() and not path.is_file():
        raise Problem(f"{path} is in the way: it is not one of WildCap's locks.", "Move it away, or delete it.")


@contextlib.contextmanager
def hold_file(
    path: Path,
    tell: Callable[[str], None] = lambda text: None,
    folder_kind: str = "capture",
    cancelled: Callable[[], bool] = lambda: False,
) -> Iterator[Lease]:
    """Hold the lease of a lock file, in a folder that must exist.

    A holder at work on this machine is refused at once, an ended one is replaced at once; for a stopped one, or one on
    another machine, this waits a term for a refresh and calls `tell`. `folder_kind`, such as "capture" or "batch", is
    for the Problem that names the holder. Raises CancelledError if `cancelled` ends the wait.
    """
    lease = Lease(path, secrets.token_hex(8))
    while not _make(lease):
        expired = _wait_out(path, tell, folder_kind, cancelled)
        if expired is not None:
            _take_over(lease, *expired)
    key = os.path.abspath(path)
    _held[key] = lease
    _clear_asides(path)
    ended = threading.Event()
    keeper = threading.Thread(target=_refresh, args=(lease, ended), name="wildcap-lease", daemon=True)
    keeper.start()
    try:
        yield lease
    finally:
        ended.set()
        keeper.join()
        del _held[key]
        with contextlib.suppress(OSError):  # the server has gone: the lease runs out
            if lease.holds():
                path.unlink(missing_ok=True)


def _make(lease: Lease) -> bool:
    """Create the lock file; return False if it exists. Empty for a moment, it counts as being made."""
    content = {**identify_process(), "since": time.strftime("%Y-%m-%dT%H:%M:%S"), "token": lease.token}
    try:
        descriptor = os.open(lease.path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    except FileExistsError:
        return False
    try:
        with open(descriptor, "wb") as file:
            file.write(json.dumps(content).encode())
    except OSError:  # left empty on a full disk, it would look like somebody who is just beginning
        with contextlib.suppress(OSError):
            lease.path.unlink()
        raise
    return True


def _wait_out(
    path: Path, tell: Callable[[str], None], folder_kind: str, cancelled: Callable[[], bool]
) -> tuple[dict, tuple | None] | None:
    """Wait until a lease can be taken over, and return its content and stamp; None if it was given back.

    Raises Problem if it is held, and CancelledError.
    """
    _refuse_stranger(path)
    first, began, waits = _stamp(path), time.monotonic(), False
    while True:
        content = _read(path)
        if content is None:
            return None
        if content and is_gone(content):
            return content, first
        if _stamp(path) != first or content and is_at_work(content):
            raise refuse(_read(path) or content, path, folder_kind)
        waited = time.monotonic() - began
        if waited > TERM_S:
            return content, first
        if waited > 1 and not waits:
            tell(f"Checking whether the worker that holds this {folder_kind} is still running ...")
            waits = True
        if cancelled():
            raise CancelledError(str(path))
        time.sleep(LOOK_S)


def _take_over(lease: Lease, expired: dict, stamp: tuple | None) -> None:
    """Remove an expired lease, unless somebody was faster; a file beside it admits one process at a time."""
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
                # the old holder awoke and gave it back, and somebody else has it since
                if _read(aside) != expired and not path.exists():
                    os.rename(aside, path)
                aside.unlink(missing_ok=True)
    finally:
        succession.path.unlink(missing_ok=True)


def _clear(succession: Path) -> None:
    """Wait for another process that takes the lease over; remove the file of one that was killed meanwhile."""
    content, stamp, began = _read(succession), _stamp(succession), time.monotonic()
    while _stamp(succession) == stamp and stamp is not None:
        if content and is_gone(content) or time.monotonic() - began > TERM_S:
            succession.unlink(missing_ok=True)
            return
        time.sleep(LOOK_S / 10)


def _clear_asides(path: Path) -> None:
    """Remove leftovers of processes that were killed while they took a lease over."""
    for aside in path.parent.glob(f"{path.name}.*"):
        content = _read(aside)
        if content and is_gone(content):
            aside.unlink(missing_ok=True)


def _refresh(lease: Lease, ended: threading.Event) -> None:
    while not ended.wait(TERM_S / REFRESHES):
        with contextlib.suppress(OSError):
            if not lease.holds():
                return
            os.utime(lease.path)


def _read(path: Path) -> dict | None:
    """Return the content of a lock file, {} if it cannot be read, None if it is missing."""
    try:
        return _parse(path)
    except FileNotFoundError:
        return None
    except OSError:
        return {}


def _parse(path: Path) -> dict:
    """Return the content of a lock file, {} if it is empty or half written. Raises OSError if it cannot be read."""
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
