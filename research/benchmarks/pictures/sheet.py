# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lay pictures out in rows and write them as a small JPEG. Pictures are sRGB [H, W, 3]."""

from pathlib import Path

import numpy as np

from core.imaging import images

MOST_BYTES = 180_000
QUALITIES = (90, 86, 82, 78, 74, 70, 64)  # of the JPEG, the first that is small enough


def in_rows(pictures: list[np.ndarray], columns: int) -> np.ndarray:
    """Return equally large pictures in rows; black fills the last one."""
    tiles = [*pictures, *[np.zeros_like(pictures[0])] * (-len(pictures) % columns)]
    return np.vstack([np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)])


def square(picture: np.ndarray, side: int, above: int = 2) -> np.ndarray:
    """Return the middle square of a picture, resampled to `side`; 1 / `above` of what is cut off lies above it."""
    height, width = picture.shape[:2]
    length = min(height, width)
    top, left = (height - length) // above, (width - length) // 2
    return images.resize(picture[top : top + length, left : left + length, :3], side, side)


def write_small(path: Path, srgb: np.ndarray) -> None:
    """Write a JPEG of the best of QUALITIES that takes no more than MOST_BYTES."""
    for quality in QUALITIES:
        images.write_srgb(path, srgb, quality=quality)
        if path.stat().st_size <= MOST_BYTES:
            return
