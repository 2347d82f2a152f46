# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that come with WildCap and are no code, networks above all: each is as it was shipped, or it is named.

shipped.json beside this file holds their SHA-256; `python -m research.training.manifest` writes it anew in a checkout
after one of them was made again, and a test sees that it was. Standard library only."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

from .messages import Problem

CORE = Path(__file__).resolve().parents[1]
MANIFEST = CORE / "capture" / "shipped.json"
TEXT = {".json", ".md", ".obj", ".txt"}
"""A checkout on Windows may give these other line ends."""
AGAIN = "Install the extension again, or check the source out again."


def find_faults(core: Path = CORE) -> list[str]:
    """What is missing or damaged under `core`, one sentence each; [] where all is as it was shipped."""
    faults = []
    for name, digest in read_manifest()["core"].items():
        path = core / name
        if not path.is_file():
            faults.append(f"{path} is missing.")
        elif hash_shipped(path) != digest:
            faults.append(f"{path} is damaged: it is not as it was shipped.")
    return faults


def require_whole(path: Path) -> None:
    """Raises Problem where a shipped file is missing or not as it was shipped; files that did not come with WildCap are
    none of its business."""
    path = Path(path).resolve()
    digest = read_manifest()["core"].get(path.relative_to(CORE).as_posix()) if path.is_relative_to(CORE) else None
    if digest is not None and not path.is_file():
        raise Problem(f"{path} is missing.", AGAIN)
    if digest is not None and hash_shipped(path) != digest:
        raise Problem(f"{path} is damaged: it is not as it was shipped.", AGAIN)


@cache
def read_manifest() -> dict[str, dict[str, str]]:
    """{"core": {path in core: SHA-256}}."""
    return json.loads(MANIFEST.read_text(encoding="utf-8"))


def hash_shipped(path: Path) -> str:
    """SHA-256 of a file, whatever line ends a text has."""
    content = path.read_bytes()
    return hashlib.sha256(content.replace(b"\r\n", b"\n") if path.suffix in TEXT else content).hexdigest()
