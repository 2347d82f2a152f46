# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write files that are whole or absent: under a temporary name first, then renamed.

In a capture, no file of the user's is deleted or overwritten (ownership.py), and a worker that was replaced writes
nothing (lease.py).
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

AWAY = {
    getattr(errno, name)
    for name in (
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
    if hasattr(errno, name)
}
"""Errors of a file server or a disk that has gone."""
_UMASK = os.umask(0o022)
os.umask(_UMASK)
MODE = 0o666 & ~_UMASK
"""Mode of every file of a capture: that of the user's other files."""
ON_WINDOWS = os.name == "nt"
OPEN_ELSEWHERE_S = 1.0
"""Time to wait for another program to close a file that is to be replaced."""


@contextlib.contextmanager
def replacing(path: Path):
    """Yield a temporary path of the same suffix and folder; rename it to `path` on success, remove it on failure.

    In a capture, a file at `path` that is not as WildCap wrote it is kept aside. Disk errors become a Problem.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    root = path.parent if path.name == "capture.json" else ownership.root_of(path)  # capture.json makes the capture
    try:
        with storage_problems(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            if root is not None:
                ownership.note_temporary(root, temporary)
            yield temporary
            _flush(temporary)
            place_file(temporary, path)
    finally:
        with contextlib.suppress(OSError):  # missing, or its folder is a file
            temporary.unlink()


@contextlib.contextmanager
def replacing_folder(path: Path):
    """Do the same for a folder whose files belong together. In a capture, the old folder's foreign files stay."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    root = ownership.root_of(path)
    try:
        with storage_problems(path):
            shutil.rmtree(temporary, ignore_errors=True)
            if root is not None:
                ownership.note_temporary(root, temporary)
            temporary.mkdir(parents=True)
            yield temporary
            place_folder(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def place_file(temporary: Path, path: Path) -> None:
    """Rename a complete file. In a capture, a file at `path` that is not as WildCap wrote it is kept aside."""
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
    """Rename a complete folder. In a capture, foreign files of the old one stay, changed ones are kept aside."""
    root, old = ownership.root_of(path), path.with_name(f".{path.name}.old")
    written = [file for file in temporary.rglob("*") if file.is_file()]
    for file in written:
        _set_mode(file)
        _flush(file)
    if root is None:
        shutil.rmtree(old, ignore_errors=True)
    else:
        check_lease(root)
        if os.path.lexists(old):  # left by a process that was killed between the two renames
            ownership.take_back(root, old)
        if path.is_symlink():  # its target is elsewhere, and its owner's
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
    """Flush to the disk: a file renamed before that may be empty after a power cut."""
    with open(file, "rb+") as opened:  # Windows only flushes a file opened for writing
        os.fsync(opened.fileno())


def _set_mode(file: Path) -> None:
    """Make a file readable as the user's others: some libraries write private files."""
    with contextlib.suppress(OSError):  # a share mounted for everybody: its files have another owner
        os.chmod(file, MODE)


def _rename(path: Path, into: Path) -> None:
    """Rename; on Windows, wait a moment for another program, such as a virus scanner, to close the file."""
    deadline = time.monotonic() + (OPEN_ELSEWHERE_S if ON_WINDOWS else 0)
    while True:
        try:
            os.replace(path, into)
            return
        except PermissionError:
            if time.monotonic() >= deadline:
                raise
            time.sleep(0.05)


def remove_file(path: Path) -> None:
    """Remove a file of a capture if it exists; one that is not as WildCap wrote it is kept aside."""
    root = ownership.root_of(path)
    with storage_problems(path):
        if path.is_file():
            if root is not None and not ownership.is_ours(root, path):
                ownership.keep_aside(root, path)
            else:
                check_lease(root or path.parent)
                path.unlink()


def remove_folder(path: Path) -> None:
    """Remove a folder of a capture if it exists; foreign files in it stay, changed ones are kept aside."""
    root = ownership.root_of(path)
    written = ownership.read_record(root)[0] if root is not None else {}
    for file in ownership.files_in(path) if path.is_dir() else ():
        if root is None or ownership.path_inside(root, file) in written:
            remove_file(file)
    with storage_problems(path):
        if path.is_dir():
            ownership.remove_empty_folders(path)


@contextlib.contextmanager
def storage_problems(path: Path):
    """Raise an OSError of the block as the Problem of writing `path`."""
    try:
        yield
    except OSError as error:
        raise storage_problem(error, path) from error


def storage_problem(error: OSError, path: Path) -> Problem:
    """Return the Problem of a failed write."""
    path = final_name(path)
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return Problem(
            f"The disk is full: {path} could not be written.",
            "Free some space (a capture needs about 1 GB) and run again; finished stages are kept.",
        )
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        if ON_WINDOWS:  # reports a file in use with the same error
            return Problem(
                f"{path} cannot be written: the folder is read-only, or another program has the file open.",
                "Close it there, or choose a folder you may write to.",
            )
        return Problem(
            f"{path} cannot be written: the folder is read-only.",
            "Choose a folder you may write to, or change its permissions.",
        )
    reason = error.strerror or error
    if error.errno in AWAY or error.errno == errno.ENOENT and not Path(path.anchor).exists():
        return Problem(
            f"The disk or file server that holds {path} does not answer ({reason}).",
            "Check that it is connected, then run again: finished stages are kept.",
        )
    return Problem(f"{path} could not be written ({reason}).", "Check the disk and the folder, then run again.")


def final_name(path: Path) -> Path:
    """Return the final name of a temporary file, or of a file in a temporary folder."""
    return Path(*(re.sub(r"^\.(.+)\.\d+\.tmp", r"\1", part) for part in path.parts))


def write_json(path: Path, content) -> None:
    """Write a value as a JSON file, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")
