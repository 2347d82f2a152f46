# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lay pictures out in rows and write them as a small JPEG. Pictures are sRGB [H, W, 3]."""

from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.imaging import images

MOST_BYTES = 180_000
QUALITIES = (90, 86, 82, 78, 74, 70, 64)  # of the JPEG, the first that is small enough


def in_rows(pictures: list[np.ndarray], columns: int) -> np.ndarray:
    """Return equally large pictures in rows; black fills the last one."""
    tiles = [*pictures, *[np.zeros_like(pictures[0])] * (-len(pictures) % columns)]
    return np.vstack([np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)])


def texture_and_mask(capture: Capture) -> tuple[np.ndarray, np.ndarray]:
    """Return a capture's texture, and the same with the shadow mask in red."""
    texture = images.read_srgb(capture.texture_png)
    mask = images.read_mask(capture.shadow_mask if capture.shadow_mask.exists() else capture.shadow_mask_auto)
    mask = images.resize(mask, texture.shape[1], texture.shape[0])[..., None]
    return texture, texture * (1 - 0.6 * mask) + mask * np.float32([0.6, 0, 0])


def square(picture: np.ndarray, side: int, above: int = 2) -> np.ndarray:
    """Return the middle square of a picture, resampled to `side`; 1 / `above` of the rest lies above it."""
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
