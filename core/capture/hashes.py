# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Content hashes of files and folders, and the identity of a capture's source."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from .photographs import list_photographs
from .regular_files import require_regular

WHOLE_BYTES = 64 << 20
"""Size up to which `sample_file` reads all: every photograph, and half a minute of a phone's video."""
BLOCKS, BLOCK_BYTES = 64, 1 << 20
"""Blocks read of a larger file, spread evenly from its first byte to its last."""
LITTER = frozenset({"thumbs.db", "desktop.ini"})
"""Files that Windows leaves in a folder of pictures."""
DIGEST_BYTES = 16
_hashes: dict[tuple, str] = {}


def hash_file(path: Path) -> str:
    """Return the content hash of a file, cached in this process by its size and time."""
    return _remember(path, _hash_whole)


def read_hash(path: Path) -> str:
    """Return the content hash of a file, never cached: where an error would cost somebody a file.

    Two writes within one tick of the disk's clock have the same time.
    """
    with open(require_regular(path), "rb") as file:
        return _hash_whole(file, 0)


def hash_bytes(content: bytes) -> str:
    """Return what `read_hash` returns for a file with this content."""
    return hashlib.blake2b(content, digest_size=DIGEST_BYTES).hexdigest()


def hash_value(value) -> str:
    """Return the hash of a JSON value, whatever the order of its keys."""
    return hash_bytes(json.dumps(value, sort_keys=True).encode())


def sample_file(path: Path) -> str:
    """Return the content hash of a file, or, above WHOLE_BYTES, the hash of its size and BLOCKS blocks, cached."""
    return _remember(path, _hash_sampled)


def hash_tree(path: Path, hash_one: Callable[[Path], str] = hash_file) -> str | dict:
    """Return the hash of a file, {relative name: hash} of a folder, or ''. Hidden files and LITTER do not count."""
    if os.path.isdir(path):  # Path's own raises an error for a name that is too long
        return {
            p.relative_to(path).as_posix(): hash_one(p)
            for p in sorted(path.rglob("*"))
            if p.is_file() and not p.name.startswith(".") and p.name.lower() not in LITTER
        }
    return hash_one(path) if os.path.isfile(path) else ""


def hash_source(source: Path | None) -> list:
    """Return [name, size, `sample_file`] of the video, or of each photograph in the folder; [] if it is gone."""
    if source is None:
        return []
    if not source.exists():
        return []
    photographs = list_photographs(source)
    return [
        [photographs.name(path), path.stat().st_size, sample_file(path)] for path in photographs.files if path.is_file()
    ]


def same_source(recorded: list, present: list) -> bool:
    """Return whether two results of `hash_source` mean the same pictures.

    A video may be renamed; the names of photographs count, because they give the order.
    """
    if len(recorded) == len(present) == 1:
        return recorded[0][1:] == present[0][1:]
    return recorded == present


def list_hashes(root: Path) -> list:
    """List the cached hashes below a folder for `add_hashes` of another process.

    An entry is [kind, path in the folder, size, time in nanoseconds, hash].
    """
    inside = str(root) + os.sep
    return [
        [kind, path.removeprefix(inside), size, when, digest]
        for (kind, path, size, when), digest in list(_hashes.items())
        if path.startswith(inside)
    ]


def add_hashes(root: Path, entries: list) -> None:
    """Add the hashes that `list_hashes` listed to the cache. Raises ValueError or TypeError for anything else."""
    hashes = {(kind, os.path.join(root, path), size, when): digest for kind, path, size, when, digest in entries}
    if not all(isinstance(digest, str) for digest in hashes.values()):
        raise ValueError("a hash is not a text")
    for key, digest in hashes.items():
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
    return hashlib.blake2b(digest_size=DIGEST_BYTES)
