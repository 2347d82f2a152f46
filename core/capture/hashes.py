# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Content hashes of files and folders, and what identifies the pictures that a capture is made from.

Standard library only.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from .regular_files import require_regular

WHOLE_BYTES = 64 << 20
"""Size up to which a source's file is read whole: every photograph, and a phone's video of half a minute."""
BLOCKS, BLOCK_BYTES = 64, 1 << 20
"""What is read of a longer one, spread evenly from its first byte to its last."""
PHOTOGRAPHS = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".exr", ".heic", ".heif")
"""Suffixes of the files in a folder of photographs that are read; others may lie beside them."""
LITTER = frozenset({"thumbs.db", "desktop.ini"})
"""What Windows leaves in a folder, above all on a share, where somebody has looked at its pictures."""
_hashes: dict[tuple, str] = {}


def hash_file(path: Path) -> str:
    """The content hash of a file; one that has kept its size and time is not read again by this process."""
    return _remember(path, _hash_whole)


def read_hash(path: Path) -> str:
    """As `hash_file`, but always read: where being wrong would cost somebody a file. Two files within one tick of the
    disk's clock have the same time."""
    with open(require_regular(path), "rb") as file:
        return _hash_whole(file, 0)


def hash_bytes(content: bytes) -> str:
    """What `read_hash` gives for a file that holds them."""
    digest = _hasher()
    digest.update(content)
    return digest.hexdigest()


def hash_value(value) -> str:
    """Of what can be written as JSON, whatever the order of its keys."""
    return hash_bytes(json.dumps(value, sort_keys=True).encode())


def sample_file(path: Path) -> str:
    """As `hash_file`, but a file of more than WHOLE_BYTES is known by its size and BLOCKS blocks of it: a film, or
    another program's network."""
    return _remember(path, _hash_sampled)


def hash_tree(path: Path, hash_one: Callable[[Path], str] = hash_file) -> str | dict:
    """The content hash of a file, {relative name: hash} of a folder, or '' for what is not there. What a system leaves
    in folders by itself, hidden files and LITTER, is not of it."""
    if path.is_dir():
        return {
            p.relative_to(path).as_posix(): hash_one(p)
            for p in sorted(path.rglob("*"))
            if p.is_file() and not p.name.startswith(".") and p.name.lower() not in LITTER
        }
    return hash_one(path) if path.is_file() else ""


def hash_source(source: Path | None) -> list:
    """[name, size, content hash by `sample_file`] of each file of a source, which is a video or a folder of
    photographs; [] where it is gone."""
    if source is None:
        return []
    files = (
        [path for path in sorted(source.iterdir()) if path.is_file() and _is_photograph(path.name)]
        if source.is_dir()
        else [source]
        if source.is_file()
        else []
    )
    return [[path.name, path.stat().st_size, sample_file(path)] for path in files]


def _is_photograph(name: str) -> bool:
    return name.lower().endswith(PHOTOGRAPHS) and not name.startswith(".")


def same_source(recorded: list, present: list) -> bool:
    """Whether two answers of `hash_source` mean the same pictures. A video may be renamed; the names of photographs
    count, for they tell their order."""

    def told(stamp: list) -> list:
        return [[name if len(stamp) > 1 else "", size, digest] for name, size, digest in stamp]

    return told(recorded) == told(present)


def tell_known(root: Path) -> list:
    """What this process knows of the files below a folder: [[kind, path in the folder, size, time in nanoseconds,
    hash]], for `take_known` of another one."""
    inside = str(root) + os.sep
    return [
        [kind, path.removeprefix(inside), size, when, digest]
        for (kind, path, size, when), digest in list(_hashes.items())
        if path.startswith(inside)
    ]


def take_known(root: Path, entries: list) -> None:
    """Takes in what `tell_known` told. Raises ValueError or TypeError for what it did not tell."""
    told = [((kind, os.path.join(root, path), size, when), digest) for kind, path, size, when, digest in entries]
    if not all(isinstance(digest, str) for _, digest in told):
        raise ValueError("a hash is no text")
    for key, digest in told:
        _hashes.setdefault(key, digest)


def _remember(path: Path, digest: Callable[[BinaryIO, int], str]) -> str:
    info = path.stat()
    key = (digest.__name__, str(path), info.st_size, info.st_mtime_ns)
    if key not in _hashes:
        with open(path, "rb") as file:
            _hashes[key] = digest(file, info.st_size)
    return _hashes[key]


def _hash_whole(file: BinaryIO, size: int) -> str:
    return hashlib.file_digest(file, _hasher).hexdigest()


def _hash_sampled(file: BinaryIO, size: int) -> str:
    if size <= WHOLE_BYTES:
        return _hash_whole(file, size)
    digest = _hasher()
    digest.update(str(size).encode())
    for block in range(BLOCKS):
        file.seek(block * (size - BLOCK_BYTES) // (BLOCKS - 1))
        digest.update(file.read(BLOCK_BYTES))
    return digest.hexdigest()


def _hasher():
    return hashlib.blake2b(digest_size=16)
