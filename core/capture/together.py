# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of one person in several lights, which a solve takes together (`core run --with`), and what of them it
depends on."""

from __future__ import annotations

from pathlib import Path

from . import stages
from .hashes import hash_file, hash_tree, sample_file
from .messages import Problem

RECORD = "capture.json"
TOLD = (*stages.by_name("solve").reads, "shadow_mask.png", "protect_mask.png", stages.PARTS, *stages.OPEN_EYES)
"""What a solve reads of another capture."""


def captures_in(named: str) -> list[Path]:
    """The captures that a setting names: a capture's folder, or a folder that holds several; none for ''. Raises
    Problem where there is none."""
    if not named:
        return []
    folder = Path(named).expanduser()
    captures = [folder] if (folder / RECORD).is_file() else sorted(path.parent for path in folder.glob(f"*/{RECORD}"))
    if not captures:
        raise Problem(
            f"{folder} is no capture, and holds none.",
            "Name the folder of another capture of the same person, usually NAME.wildcap.",
        )
    return captures


def hash_told(named: str) -> dict[str, str] | str:
    """Hash by capture and file of all that a solve reads of the captures that a setting names; of what is no capture,
    of all there is."""
    try:
        roots = captures_in(named)
    except Problem:
        return hash_tree(Path(named), sample_file)
    return {f"{root.name}/{name}": hash_file(root / name) for root in roots for name in TOLD if (root / name).is_file()}
