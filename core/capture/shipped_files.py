# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Check the shipped data files, such as networks, against the SHA-256 in shipped.json.

`python -m research.training.manifest` writes shipped.json in a checkout after one of them was made again.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

from .messages import Problem

CORE = Path(__file__).resolve().parents[1]
MANIFEST = CORE / "capture" / "shipped.json"
TEXT = {".json", ".md", ".obj", ".txt"}
"""A checkout on Windows may change the line ends of these."""
AGAIN = "Install the extension again, or check the source out again."


def find_faults(core: Path = CORE) -> list[str]:
    """List what is missing or damaged under `core`, one sentence each."""
    faults = (_find_fault(core / name, digest) for name, digest in read_manifest()["core"].items())
    return [fault for fault in faults if fault]


def require_whole(path: Path) -> None:
    """Raise Problem if a shipped file is missing or damaged; other files pass."""
    path = Path(path).resolve()
    digest = read_manifest()["core"].get(path.relative_to(CORE).as_posix()) if path.is_relative_to(CORE) else None
    if digest is not None and (fault := _find_fault(path, digest)):
        raise Problem(fault, AGAIN)


def _find_fault(path: Path, digest: str) -> str:
    if not path.is_file():
        return f"{path} is missing."
    return "" if hash_shipped(path) == digest else f"{path} is damaged: it is not as it was shipped."


@cache
def read_manifest() -> dict[str, dict[str, str]]:
    """Return {"core": {path in core: SHA-256}}."""
    return json.loads(MANIFEST.read_text(encoding="utf-8"))


def hash_shipped(path: Path) -> str:
    """Return the SHA-256 of a file, whatever line ends a text has."""
    content = path.read_bytes()
    return hashlib.sha256(content.replace(b"\r\n", b"\n") if path.suffix in TEXT else content).hexdigest()
