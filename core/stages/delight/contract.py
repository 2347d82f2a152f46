# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Interface of the delighters: a function from a capture's views to delit pictures, one at a time.

    def delighter(capture, settings, report) -> Iterator[Delit]

It chooses which registered frames it can serve (the selected ones unless it says otherwise), may fit whatever it
needs over all of them first, and reports progress and figures. The texture stage uses exactly the frames it yields.
One that needs no capture has beside it a function of a single photograph:

    def delight_photograph(srgb float32 [H, W, 3], settings) -> (albedo sRGB [H, W, 3], shadow [H, W] in [0, 1] or None)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...geometry.views import View
from ...settings.settings import DelightSettings, Settings


@dataclass(frozen=True)
class Delit:
    """Frame without its light, float32 [H, W, 3], sRGB in [0, 1], seen through `view`'s camera.

    shadow float32 [H, W] in [0, 1]: where light was blocked and its loss made up for, so that the result is to be
    trusted less; None if the delighter does not say.
    """

    view: View
    image: np.ndarray
    shadow: np.ndarray | None = None


Delighter = Callable[[Capture, Settings, Reporter], Iterator[Delit]]
Photographer = Callable[[np.ndarray, DelightSettings], tuple[np.ndarray, np.ndarray | None]]
