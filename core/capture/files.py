# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are whole or not there: everything is written under a temporary name, and gets its own when it is
complete.

In a capture nothing of the user's is deleted or overwritten on the way (ownership.py), and a worker that was replaced
writes nothing (lease.py). Standard library only.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import shutil
import time
from pathlib import Path

from . import ownership
from .hashes import read_hash
from .lease import check_lease
from .messages import Problem

_AWAY_NAMES = (
    "ESTALE",
    "ENOTCONN",
    "ETIMEDOUT",
    "EHOSTDOWN",
    "EHOSTUNREACH",
    "ENETDOWN",
    "ENETUNREACH",
    "ENODEV",
    "ENXIO",
    "EREMOTEIO",
)
AWAY = {getattr(errno, name) for name in _AWAY_NAMES if hasattr(errno, name)}
"""Errors of a file server or a disk that has gone."""
_UMASK = os.umask(0o022)
os.umask(_UMASK)
MODE = 0o666 & ~_UMASK
"""Of every file of a capture: as the user's other files."""
ON_WINDOWS = os.name == "nt"
OPEN_ELSEWHERE_S = 1.0
"""How long another program may have a file open that is to be replaced."""


@contextlib.contextmanager
def replacing(path: Path):
    """A temporary path of the same suffix in the same folder; renamed to `path` on success, removed on failure.

    In a capture, a file at `path` that is not as WildCap wrote it is kept aside (ownership.py), and nothing is written
    by a worker that was replaced (lease.py). Disk-full and read-only errors become a Problem.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    root = path.parent if path.name == "capture.json" else ownership.root_of(path)  # which makes the folder a capture
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if root is not None:
            ownership.note_temporary(root, temporary)
        yield temporary
        _flush(temporary)
        place_file(temporary, path)
    except OSError as error:
        raise storage_problem(error, path) from error
    finally:
        with contextlib.suppress(OSError):  # it is not there, or its folder is none
            temporary.unlink()


@contextlib.contextmanager
def replacing_folder(path: Path):
    """As `replacing`, for a folder whose files belong together; the old folder goes only when the new one is complete.
    In a capture, those of the old one's files that others put there stay where they are."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    root = ownership.root_of(path)
    try:
        shutil.rmtree(temporary, ignore_errors=True)
        if root is not None:
            ownership.note_temporary(root, temporary)
        temporary.mkdir(parents=True)
        yield temporary
        place_folder(temporary, path)
    except OSError as error:
        raise storage_problem(error, path) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def place_file(temporary: Path, path: Path) -> None:
    """Gives a complete file its name. In a capture, one that is there and not as WildCap wrote it is kept aside."""
    root = None if path.name in ownership.BOOKS else ownership.root_of(path)
    _set_mode(temporary)
    if root is not None:
        check_lease(root)
        if (path.is_file() or path.is_symlink()) and not ownership.is_ours(root, path):
            ownership.keep_aside(root, path)
        ownership.note_written(root, {ownership.path_inside(root, path): read_hash(temporary)})
    check_lease(root or path.parent)
    _rename(temporary, path)


def place_folder(temporary: Path, path: Path) -> None:
    """Gives a complete folder its name. In a capture, files that others put into the one before stay, and those of ours
    that were changed are kept aside."""
    root, old = ownership.root_of(path), path.with_name(f".{path.name}.old")
    written = [file for file in temporary.rglob("*") if file.is_file()]
    for file in written:
        _set_mode(file)
        _flush(file)
    if root is None:
        shutil.rmtree(old, ignore_errors=True)
    else:
        check_lease(root)
        if os.path.lexists(old):  # of a process that was killed between the two renames
            ownership.take_back(root, old)
        if path.is_symlink():  # what it leads to is elsewhere, and its owner's
            ownership.keep_aside(root, path)
        ownership.note_temporary(root, old)
        ownership.note_written(
            root, {ownership.path_inside(root, path / file.relative_to(temporary)): read_hash(file) for file in written}
        )
        check_lease(root)
    if path.exists():
        _rename(path, old)
    _rename(temporary, path)
    if root is None:
        shutil.rmtree(old, ignore_errors=True)
    else:
        ownership.clear_replaced(root, old, path)


def _flush(file: Path) -> None:
    """To the disk itself: what is renamed before that may be empty after a power cut, and on record as finished."""
    with open(file, "rb+") as opened:  # Windows flushes none that was opened to be read
        os.fsync(opened.fileno())


def _set_mode(file: Path) -> None:
    """The user's own: some libraries write files that only their owner may read. A share or a stick that is mounted for
    everybody gives files another owner, who alone may do that, and a mode that everybody can read."""
    with contextlib.suppress(OSError):
        os.chmod(file, MODE)


def _rename(path: Path, into: Path) -> None:
    """os.replace. Windows refuses while another program, such as a virus scanner, has the file open, which may be for a
    moment only."""
    ends = time.monotonic() + (OPEN_ELSEWHERE_S if ON_WINDOWS else 0)
    while True:
        try:
            os.replace(path, into)
            return
        except PermissionError:
            if time.monotonic() >= ends:
                raise
            time.sleep(0.05)


def remove_file(path: Path) -> None:
    """Removes a file of a capture that is there; one that is not as WildCap wrote it is kept aside."""
    root = ownership.root_of(path)
    try:
        if path.is_file():
            if root is not None and not ownership.is_ours(root, path):
                ownership.keep_aside(root, path)
            else:
                check_lease(root or path.parent)
                path.unlink()
    except OSError as error:
        raise storage_problem(error, path) from error


def storage_problem(error: OSError, path: Path) -> Problem:
    """The Problem of a failed write: disk full, read-only, or what the system says."""
    path = final_name(path)
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return Problem(
            f"The disk is full: {path} could not be written.",
            "Free some space (a capture needs about 1 GB) and run again; finished stages are kept.",
        )
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        if ON_WINDOWS:  # which says the same of a file that is in use
            return Problem(
                f"{path} cannot be written: the folder is read-only, or another program has the file open.",
                "Close it there, or choose a folder you may write to.",
            )
        return Problem(
            f"{path} cannot be written: the folder is read-only.",
            "Choose a folder you may write to, or change its permissions.",
        )
    if error.errno in AWAY or error.errno == errno.ENOENT and not Path(path.anchor).exists():
        return Problem(
            f"The disk or file server that {path} lies on does not answer ({error.strerror or error}).",
            "See that it is connected, then run again: what was finished is kept.",
        )
    return Problem(
        f"{path} could not be written ({error.strerror or error}).", "Check the disk and the folder, then run again."
    )


def final_name(path: Path) -> Path:
    """The name that a temporary file, or a file in a temporary folder, would have had."""
    return Path(*(re.sub(r"^\.(.+)\.\d+\.tmp", r"\1", part) for part in path.parts))


def write_json(path: Path, content) -> None:
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")
