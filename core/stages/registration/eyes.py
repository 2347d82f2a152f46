# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the subject's eyes are open: then the scan shows eyeballs between the lids, which the template's closed lids
must not follow.

The eye network says how far the lids are apart in the frames that look the face in the eyes; from the side it guesses,
and so do the face mesh's lid marks on closed lids.
"""

from __future__ import annotations

import numpy as np

FRONTAL_DEG = 25.0
OPEN_RATIO = 0.22
"""Height over width of the opening beyond which an eye counts as open, by the narrower one of a frame: the network
marks two rims on closed lids as well, so nobody's opening is 0."""
LID_MARKS = (
    246,
    161,
    160,
    159,
    158,
    157,
    173,
    7,
    163,
    144,
    145,
    153,
    154,
    155,
    466,
    388,
    387,
    386,
    385,
    384,
    398,
    249,
    390,
    373,
    374,
    380,
    381,
    382,
)
"""MediaPipe's landmarks on the rims of the lids, corners left out: those stay put when an eye closes."""


def opening(sights: list[tuple[float, tuple[float, float]]]) -> float:
    """The usual opening of the narrower eye over frames (yaw in degrees, openings of the right and left eye), those
    that look straight; nan if none."""
    straight = [min(pair) for yaw, pair in sights if abs(yaw) < FRONTAL_DEG]
    return float(np.median(straight)) if straight else float("nan")


def are_open(usual: float) -> bool:
    return usual > OPEN_RATIO  # false for nan: closed is what the template is


def spared(follow: np.ndarray, trust: np.ndarray, lids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """follow [V] and trust [468] for open eyes: the lids [V] (0 to 1) come along by stiffness, and the marks on their
    rims have no say."""
    kept = trust.copy()
    kept[list(LID_MARKS)] = 0
    return follow * (1 - np.clip(lids * 1.5, 0, 1)), kept
