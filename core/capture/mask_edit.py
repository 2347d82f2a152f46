# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Decide whether only the part of the maps that a mask edit touched can be solved again.

It can if all but the artist's masks is as it was at the last solve: maps/solved.safetensors has the state of that
solve, with its conditions. The proposal counts too: the light is held back less in what the artist added to it.
"""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

from ..settings.settings import Settings, result_settings
from . import stages
from .capture import Capture
from .code_key import code_key
from .hashes import hash_tree
from .regular_files import require_regular

FIELD = "conditions"  # of the file's metadata
PAINTED = ("shadow_mask.png", "protect_mask.png")


def obstacle(capture: Capture, settings: Settings) -> str:
    """Return why the edited part cannot be solved alone, as a sentence, or ''."""
    if settings.solve.prior:
        return "The authors' prior works in the UVs of another mesh."
    before = _stored(capture.solved)
    if before is None:
        return "No solve has left its state here yet."
    now = conditions(capture, settings)
    changed = [name for name in now if now[name] != before.get(name)]
    return f"{changed[0][0].upper()}{changed[0][1:]} changed since the last solve." if changed else ""


def conditions(capture: Capture, settings: Settings) -> dict[str, str]:
    """Return all that a solve depends on beside the painted masks: name -> hash."""
    stage = stages.by_name("solve")
    own = [result_settings(settings.solve), settings.seed, settings.compute_device, settings.delight.delighter]
    files = {
        name: hash_tree(capture.root / name) for name in (*stage.reads, *stage.optional_reads) if name not in PAINTED
    }
    inputs = {**files, "the solver's settings": own, "the solver's code": code_key(stage.module)}
    return {
        name: hashlib.blake2b(json.dumps(value, sort_keys=True).encode(), digest_size=8).hexdigest()
        for name, value in inputs.items()
    }


def _stored(path: Path) -> dict | None:
    """Read the conditions from a safetensors file's header: 8 bytes of length, then JSON; None without any."""
    try:
        with open(require_regular(path), "rb") as file:
            (length,) = struct.unpack("<Q", file.read(8))
            header = json.loads(file.read(min(length, 1 << 20)))
        return dict(json.loads(header["__metadata__"][FIELD]))
    except (OSError, ValueError, KeyError, TypeError, struct.error):
        return None
