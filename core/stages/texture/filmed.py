# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The texture as it was filmed, to compare with: the frames themselves in the place of the delit ones, from the same
views with the same weights and warps."""

from __future__ import annotations

import numpy as np

from ...capture.messages import Reporter
from .blend import blend
from .held_picture import read_held
from .projection import UnwrappedView


def filmed(observations: list[UnwrappedView], covered: np.ndarray, size: int, report: Reporter) -> np.ndarray | None:
    """The texture with the light in it, in the frames' exposure.

    Parameters
    ----------
    observations : of the views; show the frames from then on
    covered : bool [S, S], texels of the head
    size : of the map, in texels along a side
    report : hears of progress

    Returns
    -------
    Linear [size, size, 3], 1 where no view sees anything. None where a frame is gone: it is only looked at.
    """
    if not all(o.view.path.is_file() for o in observations):
        return None
    for o in observations:
        frame = read_held(o.view.path)
        # a delighter may give another size
        o.pixels = o.pixels * np.float32([frame.shape[1] / o.picture.shape[1], frame.shape[0] / o.picture.shape[0]])
        o.picture = frame.around(o.pixels[covered])
        o.log_colour = o.picture.log_colours(o.pixels)
    return np.exp(blend(observations, covered, size, report, "as filmed", 4))
