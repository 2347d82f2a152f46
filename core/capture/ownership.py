# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Track which files of a capture WildCap wrote: it deletes and replaces only those, and only if unchanged.

written.jsonl in the capture has a line for each file, with its content's hash, added before the file gets its name. So
a killed stage's leftovers are known to be ours, and a file that somebody added or changed is known not to be.
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
"""Folder for files kept aside: ours that somebody changed, and foreign ones under a name of ours."""
BOOKS = frozenset({"capture.json", "job.json", "lock", RECORD})
"""The capture's own records, which are ours whatever their content."""
LONG_BYTES = 1 << 18
"""Size from which the record is shortened: some thousand lines."""


def root_of(path: Path) -> Path | None:
    """Return the capture that contains a path, or None; a temporary folder of a capture does not count."""
    for folder in Path(os.path.abspath(path)).parents:
        if (folder / "capture.json").is_file():
            return folder
        if folder.name.startswith("."):
            return None
    return None


def note_written(root: Path, hashes: dict[str, str]) -> None:
    """Record files (path in the capture -> content hash) before they get their names."""
    _append(root, [{"path": path, "hash": digest} for path, digest in hashes.items() if path not in BOOKS])


def note_temporary(root: Path, path: Path) -> None:
    """Record a temporary file or folder of this process before it exists."""
    _append(root, [{"temporary": path_inside(root, path), "by": identify_process()}])


def claim_all(folder: Path) -> None:
    """Record all files of a folder as ours, for a capture assembled elsewhere."""
    note_written(folder, {path_inside(folder, path): read_hash(path) for path in files_in(folder)})


def is_ours(root: Path, path: Path) -> bool:
    """Return whether a file of the capture is as we wrote it."""
    inside = path_inside(root, path)
    return inside in BOOKS or _is_as_written(root, path, inside)


def keep_aside(root: Path, path: Path, was: str = "") -> None:
    """Move a file to kept/, under its own path in the capture or `was`, numbered if that is taken."""
    place = free_place(root / KEPT / (was or path_inside(root, path)))
    place.parent.mkdir(parents=True, exist_ok=True)
    os.replace(path, place)


def free_place(place: Path) -> Path:
    """Return a path itself, or numbered if it is taken."""
    numbered = (place.with_stem(f"{place.stem}_{number}") for number in range(2, 10_000))
    return next(free for free in (place, *numbered) if not os.path.lexists(free))


def clear_replaced(root: Path, replaced: Path, path: Path) -> None:
    """Empty `replaced`, the folder that was at `path` before.

    Our files are deleted, changed ones are kept aside, and foreign ones move back.
    """
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
    """Remove a folder and those in it as far as they are empty."""
    folders = [path for path in folder.rglob("*") if path.is_dir() and not path.is_symlink()]
    for each in [*sorted(folders, reverse=True), folder]:
        with contextlib.suppress(OSError):  # not empty
            each.rmdir()


def clear_leftovers(root: Path) -> None:
    """Remove the temporary files of processes that have ended, and recover folders that they had put aside."""
    for name, by in read_record(root)[1].items():
        path = root / name
        # a link must not lead out of the capture
        if is_gone(by) and os.path.lexists(path) and path.parent.resolve().is_relative_to(root.resolve()):
            if path.suffix == ".old":
                take_back(root, path)
            elif path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
    _shorten(root)


def _shorten(root: Path) -> None:
    """Drop lines without a file from a long record.

    Needs the lease. A line that another process adds meanwhile is lost: its file counts as changed, which is harmless.
    """
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
    """Finish replacing a folder that was put aside, or undo it if the new one never came. A link is kept aside."""
    path = replaced.with_name(replaced.name[1 : -len(".old")])
    if replaced.is_symlink():
        keep_aside(root, replaced, path_inside(root, path))
    elif path.exists():
        clear_replaced(root, replaced, path)
    else:
        os.replace(replaced, path)


def read_record(root: Path) -> tuple[dict[str, set[str]], dict[str, dict]]:
    """Return the written files, path -> content hashes, and the temporary ones, path -> process."""
    record = root / RECORD
    try:
        info = require_regular(record).stat()
    except FileNotFoundError:
        return {}, {}
    return _parse(record, info.st_size, info.st_mtime_ns)


@lru_cache(maxsize=8)
def _parse(record: Path, size: int, changed: int) -> tuple[dict[str, set[str]], dict[str, dict]]:
    """Parse the record as it was at that size and time."""
    written: dict[str, set[str]] = {}
    temporary: dict[str, dict] = {}
    for line in record.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError, KeyError, TypeError):  # cut off when its writer was killed
            entry = json.loads(line)
            if "path" in entry:
                written.setdefault(entry["path"], set()).add(entry["hash"])
            elif _is_temporary_name(entry["temporary"]) and {"host", "pid"} <= set(entry["by"]):
                temporary[entry["temporary"]] = dict(entry["by"])
    return written, temporary


def _is_temporary_name(path: str) -> bool:
    """Return whether a path can be a temporary file of ours: a stranger's record may name anything."""
    parts = PurePosixPath(path).parts
    inside = bool(parts) and not {"..", "/"} & set(parts) and "\\" not in path and ":" not in path
    return inside and parts[-1].startswith(".")


def _append(root: Path, lines: Iterable[dict]) -> None:
    """Append lines in one write, so that those of two processes do not mix. Raises OSError if the disk is full."""
    text = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
    if text:
        with open(root / RECORD, "ab+", buffering=0) as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(end - 1, 0))
            if end and file.read(1) != b"\n":  # cut off by a full disk or a kill
                text = b"\n" + text
            if file.write(text) < len(text):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(root / RECORD))


def path_inside(root: Path, path: Path) -> str:
    """Return a path relative to the capture, with forward slashes, as the record has it."""
    return Path(os.path.relpath(os.path.abspath(path), os.path.abspath(root))).as_posix()


def _is_as_written(root: Path, file: Path, inside: str) -> bool:
    """Return whether a file, which is or was at `inside`, has the content that we wrote there. A link never has."""
    return not file.is_symlink() and read_hash(file) in read_record(root)[0].get(inside, ())


def is_leftover(root: Path, path: Path) -> bool:
    """Return whether a file is, or lies in, a temporary one of an ended process.

    A folder that was put aside does not count: it may hold foreign files.
    """
    inside = PurePosixPath(path_inside(root, path))
    owners = [
        by for name, by in read_record(root)[1].items() if inside.is_relative_to(name) and not name.endswith(".old")
    ]
    return bool(owners) and not path.is_symlink() and all(is_gone(by) for by in owners)


def files_in(folder: Path) -> list[Path]:
    """List all files and links below a folder, without following links."""
    return [path for path in sorted(folder.rglob("*")) if path.is_file() or path.is_symlink()]


def kept_files(root: Path) -> set[str]:
    """Return the paths in the capture of all files kept aside."""
    return {path_inside(root, path) for path in files_in(root / KEPT)} if (root / KEPT).is_dir() else set()
