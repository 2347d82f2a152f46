# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of WildCap 0.1.0: capture.json of format 1 kept, per finished stage, one hash of its inputs, settings, code
and data together.

With the code and data of 0.1.0, whose hashes format_1.json holds, that hash can be made again, and so says whether
inputs and settings are still the same. Standard library only.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache
from pathlib import Path

from .hashes import hash_tree, hash_value
from .settings import Settings
from .stages import Stage

INDIFFERENT = ("checkpoint_every", "low_memory")
"""Settings that no result depended on."""
PATHS = {
    "delight": "folder",
    "cameras": "import_from",
    "registration": "template",
    "shadow_mask": "softened",
    "solve": "prior",
}
"""Settings that name something outside of the capture, by stage."""

STAMP = "format_1_stamp"
"""Where capture.json keeps the name, size and time that 0.1.0 knew a source by, once the source's content is known."""


def keep_stamp(stamp: list) -> dict:
    """What capture.json needs of a source's stamp that is about to be replaced: all of it, where it is 0.1.0's."""
    return {STAMP: stamp} if any(isinstance(known, int) for _, _, known in stamp) else {}


def is_unchanged(root: Path, record: dict, stage: Stage, settings: Settings) -> bool:
    """Whether the inputs and settings of a stage that 0.1.0 finished are what they were then.

    Parameters
    ----------
    root : the capture's folder
    record : capture.json's content
    stage : that 0.1.0 finished
    settings : as they are now
    """
    finished, made = record["stages"][stage.name], _code_and_data()[stage.name]
    chosen = asdict(getattr(settings, stage.name))
    parts: list = [
        {
            name: chosen.get(name, value)
            for name, value in finished.get("settings", {}).items()
            if name not in INDIFFERENT
        },
        {name: getattr(settings, "compute_device" if name == "device" else name) for name in made["shared"]},
        made["code"],
    ]
    if stage.name == "frames":
        parts.append(record.get(STAMP, record.get("source_stamp", [])))
    named = chosen[PATHS[stage.name]] if stage.name in PATHS else ""
    if named:
        parts.append(hash_tree(Path(named).expanduser()))
        if stage.name == "solve":
            parts += [[name, hash_tree(root / name)] for name in ("own_head.obj", "own_head.json")]
    parts += [[name, hash_tree(root / name)] for name in made["inputs"]]
    parts += made["data"]
    return finished.get("key") == hash_value(parts)


@cache
def _code_and_data() -> dict:
    """Stage -> {"code": hash of its room, "shared": shared settings, "inputs": files of the capture, "data": hashes of
    the shipped files}, all of 0.1.0."""
    return json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
