# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames' own fine detail in the enlarged albedo: where the views agreed on a band of it, that band takes the place
of what was made up."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from ..imaging import images

STRIP = 256
COARSE = 1.0
"""Sigma, in texels of the texture, of the blur that parts the bands: that of core/texture/detail.py."""


def guide(srgb: np.ndarray, detail: np.ndarray, texture: int, progress: Callable[[float], None]) -> None:
    """Puts `detail` [D, D, 2] (band of log luminance, already multiplied by the share of it that is certain, and that
    share) into an albedo, sRGB [S, S, 3], in place. `texture`: side of the texture that the band is finer than."""
    size = len(srgb)
    sigma = COARSE * size / texture
    detail = cv2.resize(detail, (size, size), interpolation=cv2.INTER_LINEAR if len(detail) <= size else cv2.INTER_AREA)
    grey = np.empty((size, size), np.float32)
    for row in range(0, size, STRIP):
        rows = slice(row, row + STRIP)
        grey[rows] = np.log(np.maximum(images.srgb_to_linear(srgb[rows]), 2e-3)).mean(-1)
    made_up = grey - cv2.GaussianBlur(grey, (0, 0), sigma)
    for row in range(0, size, STRIP):
        rows = slice(row, row + STRIP)
        change = np.exp(detail[rows, :, 0] - detail[rows, :, 1] * made_up[rows])
        srgb[rows] = images.linear_to_srgb(np.clip(images.srgb_to_linear(srgb[rows]) * change[..., None], 0, 1))
        progress(min(1.0, (row + STRIP) / size))
