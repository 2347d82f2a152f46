# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes out what is left of pose and surface errors: a smooth warp of each view's UV texture onto the others' consensus (imaging/warps.py)."""

from __future__ import annotations

import numpy as np

from ..contract.messages import Reporter
from ..face.head import Unfolded
from ..geometry import raster
from ..geometry.views import lengths
from ..imaging.warps import find_warps, moved
from .projection import Observation


def align(observations: list[Observation], surface: Unfolded, report: Reporter) -> float:
    """Resamples every observation along its warp. Returns the mean length of the last warps in texels, where they count."""
    if len(observations) < 2:
        return 0.0
    for observation in observations:
        observation.pixels = raster.bleed(observation.pixels, surface.covered)
    total = len(observations) + 6

    def read(view: int, warp: np.ndarray | None) -> np.ndarray:
        report.check()
        if warp is not None:
            observations[view].resample(moved(observations[view].pixels, warp), None)
        return observations[view].log_colour

    warps = find_warps(read, [o.weight for o in observations],
                       lambda share, view: report.progress(total - 6 + 2 * share, total, f"aligning {observations[view].name}"))
    for warp, observation in zip(warps, observations, strict=True):
        observation.resample(moved(observation.pixels, warp), warp)
    reach = [lengths(warp)[o.weight > 0.25 * o.weight.max()] for warp, o in zip(warps, observations, strict=True)]
    return float(np.concatenate(reach).mean())
