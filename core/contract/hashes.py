# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What tells whether a stage's inputs have changed: hashes of files, folders and code, and stamps of sources too long to be read.

Ground floor: standard library only.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

_hashes: dict[tuple, str] = {}


def hash_file(path: Path) -> str:
    """The content hash of a file; one that has kept its size and time is not read again."""
    info = path.stat()
    key = (str(path), info.st_size, info.st_mtime_ns)
    if key not in _hashes:
        with open(path, "rb") as file:
            _hashes[key] = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    return _hashes[key]


def hash_tree(path: Path) -> str | dict:
    """The content hash of a file, {relative name: hash} of a folder, or '' for what is not there."""
    if path.is_dir():
        return {p.relative_to(path).as_posix(): hash_file(p) for p in sorted(path.rglob("*")) if p.is_file() and not p.name.startswith(".")}
    return hash_file(path) if path.is_file() else ""


def source_stamp(source: str) -> list:
    """Name, size and time of a source's files ([] when it is gone): a long video is not read to see that it is the same, nor its folder's name."""
    path = Path(source)
    files = [] if not source else sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path] if path.is_file() else []
    return [[p.name, p.stat().st_size, p.stat().st_mtime_ns] for p in files]


def code_hash(module: str) -> str:
    """Hash of the stage's own room, without importing it."""
    room = Path(__file__).parents[1] / module.split(".", 1)[1]
    digest = hashlib.blake2b(digest_size=8)
    for path in sorted(room.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
