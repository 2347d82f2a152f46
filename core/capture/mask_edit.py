# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether only the part of the maps that a mask edit touched can be solved again: when all but the artist's masks is as
it was at the last solve. The proposal has to be, too: what the artist added to it, the light is held back less.

Ground floor: standard library only. What the last solve found stands in maps/solved.safetensors, with the conditions it
was found under.
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
    """Why the edited part cannot be solved alone, as a sentence; '' where it can."""
    if settings.solve.prior:
        return "The authors' prior works in the UVs of another mesh."
    before = _stored(capture.solved)
    if before is None:
        return "No solve has left its state here yet."
    now = conditions(capture, settings)
    changed = [name for name in now if now[name] != before.get(name)]
    return f"{changed[0][0].upper()}{changed[0][1:]} changed since the last solve." if changed else ""


def conditions(capture: Capture, settings: Settings) -> dict[str, str]:
    """All that a solve depends on beside the painted masks: name -> hash."""
    stage = stages.by_name("solve")
    chosen = [result_settings(settings.solve), settings.seed, settings.compute_device, settings.delight.delighter]
    files = {
        name: hash_tree(capture.root / name) for name in (*stage.reads, *stage.optional_reads) if name not in PAINTED
    }
    inputs = {**files, "the solver's settings": chosen, "the solver's code": code_key(stage.module)}
    return {
        name: hashlib.blake2b(json.dumps(value, sort_keys=True).encode(), digest_size=8).hexdigest()
        for name, value in inputs.items()
    }


def _stored(path: Path) -> dict | None:
    """The conditions in a safetensors file's header: 8 bytes of length, then JSON; None where there are none."""
    try:
        with open(require_regular(path), "rb") as file:
            (length,) = struct.unpack("<Q", file.read(8))
            header = json.loads(file.read(min(length, 1 << 20)))
        return dict(json.loads(header["__metadata__"][FIELD]))
    except (OSError, ValueError, KeyError, TypeError, struct.error):
        return None
