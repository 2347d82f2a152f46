# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of one person in several lights, which one solve takes together (`core run --with`)."""

from __future__ import annotations

from pathlib import Path

from . import stages
from .hashes import hash_file, hash_tree, sample_file
from .messages import Problem

RECORD = "capture.json"
INPUTS = (*stages.by_name("solve").reads, "shadow_mask.png", "protect_mask.png", stages.PARTS, *stages.OPEN_EYES)
"""Files that a solve reads of another capture."""


def captures_in(setting: str) -> list[Path]:
    """Return the capture that the setting names, or all in the folder that it names; [] for ''.

    Raises Problem if there is none.
    """
    if not setting:
        return []
    folder = Path(setting).expanduser()
    captures = [folder] if (folder / RECORD).is_file() else sorted(path.parent for path in folder.glob(f"*/{RECORD}"))
    if not captures:
        raise Problem(
            f"{folder} is not a capture and contains none.",
            "Choose the folder of another capture of the same person, usually NAME.wildcap.",
        )
    return captures


def hash_inputs(setting: str) -> dict[str, str] | str:
    """Return the hash of each file that a solve reads of the other captures; of a folder without captures, of all."""
    try:
        roots = captures_in(setting)
    except Problem:
        return hash_tree(Path(setting), sample_file)
    return {
        f"{root.name}/{name}": hash_file(root / name) for root in roots for name in INPUTS if (root / name).is_file()
    }
