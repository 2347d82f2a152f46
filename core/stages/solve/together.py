# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Read other captures of the same person, in other light, which separate this one's light from the skin (split.py)."""

from __future__ import annotations

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...capture.together import captures_in
from ...face.head import read_filmed_head
from ...settings.settings import Settings
from ...solver.evidence import Evidence
from .capture_evidence import read_evidence

SIDE_TEXELS = 512  # of the maps that are read, which have to resolve a cell of split.py


def read_others(capture: Capture, settings: Settings, report: Reporter) -> list[Evidence]:
    """Read the captures that settings.solve.together names, but for this one. Raises Problem for unusable ones."""
    named = captures_in(settings.solve.together)
    roots = [root for root in named if root.resolve() != capture.root.resolve()]
    if named and not roots:
        raise Problem(
            f"{settings.solve.together} is this capture itself.", "Name captures of the same person in other light."
        )
    others = []
    for k, root in enumerate(roots):
        report.progress(k, len(roots), f"reading {root.name}")
        other = Capture(root)
        if not other.texture.is_file() or not other.shadow_mask_auto.is_file():
            raise Problem(
                f"{root.name} has no texture and shadow mask yet.",
                "Reconstruct it up to the shadow mask first, or leave it out.",
            )
        others.append(read_evidence(other, read_filmed_head(other), SIDE_TEXELS))
    return others
