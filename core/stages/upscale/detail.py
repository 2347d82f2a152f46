# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Put the frames' own fine detail into the enlarged albedo.

Where the views agreed on a band of it, that band takes the place of invented detail.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from ...imaging import images

STRIP_ROWS = 256
COARSE_SIGMA_TEXELS = 1.0  # of the texture, for the blur that parts the bands: that of core/stages/texture/detail.py


def guide(srgb: np.ndarray, detail: np.ndarray, texture: int, progress: Callable[[float], None]) -> None:
    """Put the texture's fine detail into an enlarged albedo [S, S, 3], sRGB, in place.

    detail [D, D, 2] is the band of log luminance, already multiplied by the share of it that is certain, and that
    share. The band is finer than a texture of that side, in texels. `progress` gets the share done.
    """
    size = len(srgb)
    sigma = COARSE_SIGMA_TEXELS * size / texture
    detail = cv2.resize(detail, (size, size), interpolation=cv2.INTER_LINEAR if len(detail) <= size else cv2.INTER_AREA)
    grey = np.empty((size, size), np.float32)
    for row in range(0, size, STRIP_ROWS):
        rows = slice(row, row + STRIP_ROWS)
        grey[rows] = np.log(np.maximum(images.srgb_to_linear(srgb[rows]), 2e-3)).mean(-1)
    made_up = grey - cv2.GaussianBlur(grey, (0, 0), sigma)
    for row in range(0, size, STRIP_ROWS):
        rows = slice(row, row + STRIP_ROWS)
        change = np.exp(detail[rows, :, 0] - detail[rows, :, 1] * made_up[rows])
        srgb[rows] = images.linear_to_srgb(np.clip(images.srgb_to_linear(srgb[rows]) * change[..., None], 0, 1))
        progress(min(1.0, (row + STRIP_ROWS) / size))
