# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What both kinds of source hand on: a picture with its place in the source, and the sampling they share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import images


@dataclass(frozen=True)
class Picture:
    """One sampled picture: srgb [H, W, 3] upright and at its final size, index in the source (decoded frame or sorted file),
    time_s (None for a photograph), source (file name of a photograph), focal_px at this size where the file says it,
    and how far the reading is: `done` of `of`."""

    srgb: np.ndarray
    index: int
    time_s: float | None
    source: str
    focal_px: float | None
    done: int
    of: int


def evenly(count: int, most: int) -> np.ndarray:
    """At most `most` indices of 0 ... count-1 at equal intervals, first and last among them."""
    return np.arange(count) if count <= most else np.round(np.linspace(0, count - 1, most)).astype(int)


def fit(pixels: np.ndarray, long_side: int) -> np.ndarray:
    """[H, W, 3] shrunk so that its longer side is at most `long_side`; never enlarged."""
    height, width = pixels.shape[:2]
    scale = long_side / max(height, width)
    return pixels if scale >= 1 else images.resize(pixels, max(1, round(width * scale)), max(1, round(height * scale)))
