# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Test for open eyes: then the scan shows eyeballs between the lids, which the closed lids must not follow.

The eye network measures how far the lids are apart in frontal frames; from the side it guesses, and so do the face
mesh's lid marks on closed lids.
"""

import numpy as np

from ...face.faces import EYE_LINES, LEFT_EYE, RIGHT_EYE

FRONTAL_DEG = 25.0
OPEN_RATIO = 0.22
"""Height over width beyond which the narrower eye of a frame counts as open: the network marks two rims on closed lids
as well, so nobody's opening is 0."""
LID_MARKS = [mark for line in EYE_LINES for mark in line if mark not in (*RIGHT_EYE, *LEFT_EYE)]
"""MediaPipe's landmarks on the rims of the lids without the corners, which stay put when an eye closes."""


def opening(sights: list[tuple[float, tuple[float, float]]]) -> float:
    """Return the median opening of the narrower eye over frontal frames; nan if there is none.

    sights are (yaw in degrees, openings of the right and left eye).
    """
    straight = [min(pair) for yaw, pair in sights if abs(yaw) < FRONTAL_DEG]
    return float(np.median(straight)) if straight else float("nan")


def are_open(usual: float) -> bool:
    return usual > OPEN_RATIO  # false for nan: closed is what the template is


def spare_lids(follow: np.ndarray, trust: np.ndarray, lids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return follow [V] and trust [468] for open eyes.

    The lids [V] (0 to 1) come along by stiffness, and the marks on their rims do not count.
    """
    spared_trust = trust.copy()
    spared_trust[LID_MARKS] = 0
    return follow * (1 - np.clip(lids * 1.5, 0, 1)), spared_trust
