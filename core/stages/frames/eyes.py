# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blinks, judged by the subject's own eyes in the frames around, so that lids that stay closed are not a blink."""

from __future__ import annotations

import numpy as np

OPEN_RATIO = 0.2
"""Usual height over width of both eyes from which blinks can be detected."""
SHUT_SHARE = 0.55
"""In a blink both eyes are below this share of their usual openness."""
AROUND_S = 0.6
"""Compared time before and after a frame: longer than a blink, shorter than a turn of the head."""


def blinks(openings: list[tuple[float, float] | None], times: list[float | None]) -> np.ndarray:
    """Return which frames [N] catch a blink, from the openness of right and left eye (None: no face).

    Without times (photographs) all frames are compared with each other.
    """
    opening = np.array([(np.nan, np.nan) if o is None else o for o in openings], float).reshape(-1, 2)
    measured = np.isfinite(opening[:, 0])
    time = np.zeros(len(opening)) if any(t is None for t in times) else np.array(times, float)
    blinking = np.zeros(len(opening), bool)
    for i in np.flatnonzero(measured):
        # above the median: a blink may take a third of them
        usual = np.percentile(opening[measured & (np.abs(time - time[i]) <= AROUND_S)], 70, axis=0)
        blinking[i] = (usual > OPEN_RATIO).all() and (opening[i] < SHUT_SHARE * usual).all()
    return blinking
