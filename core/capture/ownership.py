# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whose a file in a capture is. WildCap deletes and replaces what it wrote, as it wrote it, and nothing else.

The capture's written.jsonl says what that is: one line for each file, with its content's hash, added before the file
gets its name. So what a killed stage left is known to be ours, and a file that somebody put there or changed is known
not to be. Standard library only.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path, PurePosixPath

from .hashes import read_hash
from .processes import identify_process, is_gone
from .regular_files import require_regular

RECORD = "written.jsonl"
KEPT = "kept"
"""Folder of a capture for what was in the way: files of ours that somebody changed, and others under a name of ours."""
BOOKS = frozenset({"capture.json", "job.json", "lock", RECORD})
"""The capture's own books, which are ours whatever stands in them."""
LONG_BYTES = 1 << 18
"""Of the record, from which on it is shortened: some thousand lines, of a long film's frames or of a day's painting."""


def root_of(path: Path) -> Path | None:
    """The capture that a path lies in, if it lies in one; not what lies in a temporary folder of one, which is ours as
    a whole."""
    parents = Path(os.path.abspath(path)).parents
    for folder in parents:
        if (folder / "capture.json").is_file():
            return folder
        if folder.name.startswith("."):
            return None
    return None


def note_written(root: Path, hashes: dict[str, str]) -> None:
    """Adds files (path in the capture -> content hash) to the record, before they get their names."""
    _append(root, [{"path": path, "hash": digest} for path, digest in hashes.items() if path not in BOOKS])


def note_temporary(root: Path, path: Path) -> None:
    """Adds a temporary file or folder of this process to the record, before it is made."""
    _append(root, [{"temporary": path_inside(root, path), "by": identify_process()}])


def claim_all(folder: Path) -> None:
    """Starts the record of a capture that was put together elsewhere by us: all that lies in it is ours."""
    note_written(folder, {path_inside(folder, path): read_hash(path) for path in files_in(folder)})


def is_ours(root: Path, path: Path) -> bool:
    """Whether a file of the capture is as we wrote it."""
    inside = path_inside(root, path)
    return inside in BOOKS or _is_as_written(root, path, inside)


def keep_aside(root: Path, path: Path, was: str = "") -> Path:
    """Moves a file out of the way of one of ours, to kept/ under its own name (or `was`, a path in the capture), or
    with a number where that is taken. Returns its new place."""
    place = root / KEPT / (was or path_inside(root, path))
    place.parent.mkdir(parents=True, exist_ok=True)
    free = free_place(place)
    os.replace(path, free)
    return free


def free_place(place: Path) -> Path:
    """The place, with a number where it is taken."""
    numbered = (place.with_stem(f"{place.stem}_{number}") for number in range(2, 10_000))
    return next(free for free in (place, *numbered) if not os.path.lexists(free))


def clear_replaced(root: Path, replaced: Path, path: Path) -> None:
    """Empties `replaced`, the folder that was at `path` before a new one took its name. What is ours goes, what
    somebody changed is kept aside, and a file that others put there moves back to where it was."""
    for file in files_in(replaced):
        was = path / file.relative_to(replaced)
        inside = path_inside(root, was)
        if _is_as_written(root, file, inside):
            file.unlink()
        elif os.path.lexists(was) or inside in read_record(root)[0]:
            keep_aside(root, file, inside)
        else:
            was.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, was)
    remove_empty_folders(replaced)


def remove_empty_folders(folder: Path) -> None:
    """A folder and those in it, as far as nothing else is left in them."""
    for each in (
        *sorted((path for path in folder.rglob("*") if path.is_dir() and not path.is_symlink()), reverse=True),
        folder,
    ):
        with contextlib.suppress(OSError):  # it is not empty
            each.rmdir()


def clear_leftovers(root: Path) -> None:
    """Removes the temporary files of processes that have ended, and takes back a folder that one of them had just put
    aside."""
    for left, by in read_record(root)[1].items():
        path = root / left
        # no link leads out of the capture
        if is_gone(by) and os.path.lexists(path) and path.parent.resolve().is_relative_to(root.resolve()):
            if path.suffix == ".old":
                take_back(root, path)
            elif path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
    _shorten(root)


def _shorten(root: Path) -> None:
    """Rewrites a record that has grown long without what no file answers to any more. Only under the lease; a line that
    another process of the user adds in the same moment is lost, and its file then counts as changed, which loses
    nothing."""
    record = root / RECORD
    if not record.is_file() or record.stat().st_size < LONG_BYTES:
        return
    written, temporary = read_record(root)
    lines = [
        {"path": path, "hash": read_hash(root / path)}
        for path in written
        if (root / path).is_file() and is_ours(root, root / path)
    ]
    lines += [{"temporary": path, "by": by} for path, by in temporary.items() if (root / path).exists()]
    short = record.with_name(f".{RECORD}.{os.getpid()}.tmp")
    note_temporary(root, short)
    short.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    os.replace(short, record)


def take_back(root: Path, replaced: Path) -> None:
    """A folder that was put aside for a new one: finishes that, or undoes it where the new one never came. A link is
    kept aside as it is."""
    path = replaced.with_name(replaced.name[1 : -len(".old")])
    if replaced.is_symlink():
        keep_aside(root, replaced, path_inside(root, path))
    elif path.exists():
        clear_replaced(root, replaced, path)
    else:
        os.replace(replaced, path)


def read_record(root: Path) -> tuple[dict[str, set[str]], dict[str, dict]]:
    """What was written: path -> content hashes; and what was temporary: path -> process."""
    record = root / RECORD
    try:
        info = require_regular(record).stat()
    except FileNotFoundError:
        return {}, {}
    return _parse(record, info.st_size, info.st_mtime_ns)


@lru_cache(maxsize=8)
def _parse(record: Path, size: int, changed: int) -> tuple[dict[str, set[str]], dict[str, dict]]:
    """The record as it was at that size and time."""
    written: dict[str, set[str]] = {}
    temporary: dict[str, dict] = {}
    for line in record.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError, KeyError, TypeError):  # a line that was cut off when its writer was killed
            entry = json.loads(line)
            if "path" in entry:
                written.setdefault(entry["path"], set()).add(entry["hash"])
            elif _is_temporary_name(entry["temporary"]) and {"host", "pid"} <= set(entry["by"]):
                temporary[entry["temporary"]] = dict(entry["by"])
    return written, temporary


def _is_temporary_name(path: str) -> bool:
    """Whether it can be a temporary file or folder of ours: in the capture, and hidden. A record may come from a
    stranger with the capture it lies in."""
    parts = PurePosixPath(path).parts
    return (
        bool(parts)
        and not {"..", "/"} & set(parts)
        and "\\" not in path
        and ":" not in path
        and parts[-1].startswith(".")
    )


def _append(root: Path, lines: Iterable[dict]) -> None:
    """In one write, so that the lines of two processes do not mix. Raises OSError where they do not fit on the disk."""
    text = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
    if text:
        with open(root / RECORD, "ab+", buffering=0) as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(end - 1, 0))
            if end and file.read(1) != b"\n":  # a line that did not fit on the disk, or whose writer was killed
                text = b"\n" + text
            if file.write(text) < len(text):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(root / RECORD))


def path_inside(root: Path, path: Path) -> str:
    """A path as the record has it: relative to the capture, with forward slashes."""
    return Path(os.path.relpath(os.path.abspath(path), os.path.abspath(root))).as_posix()


def _is_as_written(root: Path, file: Path, inside: str) -> bool:
    """Whether a file, which is or was at `inside`, holds what we wrote there. A link is nobody's but whoever made
    it."""
    return not file.is_symlink() and read_hash(file) in read_record(root)[0].get(inside, ())


def is_leftover(root: Path, path: Path) -> bool:
    """Whether a file is temporary, or lies in a temporary folder, and its process has ended. Not in a folder that was
    put aside, which may hold files of others."""
    inside = PurePosixPath(path_inside(root, path))
    owners = [
        by for left, by in read_record(root)[1].items() if inside.is_relative_to(left) and not left.endswith(".old")
    ]
    return bool(owners) and not path.is_symlink() and all(is_gone(by) for by in owners)


def files_in(folder: Path) -> list[Path]:
    """All files and links in a folder and those below; what a link leads to is not looked at."""
    return [path for path in sorted(folder.rglob("*")) if path.is_file() or path.is_symlink()]


def kept_files(root: Path) -> set[str]:
    """What was kept aside so far: paths in the capture."""
    return {path_inside(root, path) for path in files_in(root / KEPT)} if (root / KEPT).is_dir() else set()
