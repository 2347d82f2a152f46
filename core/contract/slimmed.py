# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What was slimmed away of a capture (slimming.py) counts as if it were there, by the hashes that were taken of it.
Standard library only.

capture.json keeps them in the entry of the stage that made it: {"slimmed": {"frames/": {"00000.jpg": hash, ...}}}. So
they go with that entry, also where an older version, which does not know of them, has the stage run again.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from .hashes import hash_tree
from .stages import STAGES, Stage


def hashes_of(record: dict) -> dict[str, str | dict]:
    """Name in some stage's `writes` -> what `hash_tree` gave for it before it was slimmed away. `record` is
    capture.json's content."""
    return {name: tree for entry in record["stages"].values() for name, tree in entry.get("slimmed", {}).items()}


def hash_artefact(root: Path, record: dict, name: str) -> str | dict:
    """As `hash_tree`, of a name in the capture folder `root`; what was slimmed away has the hashes that it had."""
    gone = hashes_of(record)
    return gone[name] if name in gone else hash_tree(root / name)


def is_back(root: Path, entry: dict) -> bool:
    """Whether all that was slimmed away of one stage is there, byte for byte. `entry` is the stage's in
    capture.json."""
    return all(hash_tree(root / name) == tree for name, tree in entry["slimmed"].items())


def makers(record: dict, steps: Iterable[Stage]) -> list[Stage]:
    """The stages that must run before `steps` can, for what these read was slimmed away, in the chain's order. What a
    step itself writes does not count."""
    gone, steps = hashes_of(record), tuple(steps)
    wanted = {name for step in steps for name in (*step.reads, *step.optional_reads)}
    stages: list[Stage] = []
    for stage in reversed(STAGES):
        if stage not in steps and any(name in gone and name in wanted for name in stage.writes):
            stages.insert(0, stage)
            wanted |= {*stage.reads, *stage.optional_reads}
    return stages
