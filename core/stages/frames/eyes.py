# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which frames catch a blink: told by the subject's own eyes in the frames around, so lids that stay closed are no
blink."""

from __future__ import annotations

import numpy as np

OPEN_RATIO = 0.2
"""Height over width of an opening that both eyes usually exceed where a blink can be told."""
SHUT_SHARE = 0.55
"""In a blink both eyes are below this share of what they usually are."""
AROUND_S = 0.6
"""How far around a frame its eyes are compared, in seconds: longer than a blink, shorter than a turn of the head."""


def blinks(openings: list[tuple[float, float] | None], times: list[float | None]) -> np.ndarray:
    """Which frames [N] catch a blink, from the openness of right and left eye (None: no face).

    Without times (photographs) all frames are compared with each other.
    """
    opening = np.array([(np.nan, np.nan) if o is None else o for o in openings], float).reshape(-1, 2)
    seen = np.isfinite(opening[:, 0])
    time = np.zeros(len(opening)) if any(t is None for t in times) else np.array(times, float)
    blinking = np.zeros(len(opening), bool)
    for i in np.flatnonzero(seen):
        # above the middle: a blink may take a third of them
        usual = np.percentile(opening[seen & (np.abs(time - time[i]) <= AROUND_S)], 70, axis=0)
        blinking[i] = (usual > OPEN_RATIO).all() and (opening[i] < SHUT_SHARE * usual).all()
    return blinking
