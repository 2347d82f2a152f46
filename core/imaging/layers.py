# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of an artist over a map: read, brought to the map's size, and laid over it.

A layer is [S, S, 4]: values as the map's file stores them, not multiplied by the alpha that follows. A smaller layer
than the map keeps the map's detail that is finer than its own texels.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..capture.messages import Problem
from . import images

SMALLEST, LARGEST = 256, 8192
"""Side of a layer, in texels."""


def read_layer(path: Path) -> np.ndarray:
    """Return a layer, float32 [S, S, 4]; grey becomes three channels.

    Raises Problem if it cannot be read, is not square, of another size than SMALLEST to LARGEST, or has no alpha.
    """
    stored, _ = images.read_straight(path)
    check_shape(path, stored)
    colours = np.repeat(stored[..., :1], 3, 2) if stored.shape[2] == 2 else stored[..., :3]
    return np.concatenate([colours, stored[..., -1:]], 2)


def check_shape(path: Path, stored: np.ndarray, alpha: bool = True) -> None:
    """Raise Problem for pixels [H, W, C] that are no layer's: not square, too small or large, or without alpha."""
    height, width, channels = stored.shape
    if width != height or not SMALLEST <= width <= LARGEST:
        raise Problem(
            f"{path} is {width} x {height}, but a layer is square, with {SMALLEST} to {LARGEST} texels a side.",
            "Save the whole map as one square picture, without cropping it.",
        )
    if alpha and channels not in (2, 4):
        raise Problem(
            f"{path} has no alpha channel, so it would cover everything that is below.",
            "Save it with transparency where the map is to stay as it is.",
        )


def resize_layer(layer: np.ndarray, size: int) -> np.ndarray:
    """Return a layer at another size; what it does not cover lends it no colour, and nothing else becomes covered."""
    if len(layer) == size:
        return layer
    cover = layer[..., 3:]
    weighed = _resized(np.concatenate([layer[..., :3] * cover, cover], 2), size)
    weighed[..., :3] /= np.maximum(weighed[..., 3:], 1e-6)
    return weighed


def lay_over(below: np.ndarray, layer: np.ndarray, opacity: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return a map [L, L, C] under a layer, C 1 (the mean of the layer's three) or 3, and its cover [L, L].

    Where the cover is 0, the map's values stay to the last bit.
    """
    size, opacity = len(below), np.float32(opacity)
    own = resize_layer(layer, size) if len(layer) > size else layer
    colours = own[..., :3] if below.shape[2] == 3 else own[..., :3].mean(2, keepdims=True)
    seen = below if len(own) == size else _resized(below, len(own))
    change, cover = own[..., 3:] * (colours - seen), own[..., 3:]
    if len(own) < size:  # the change is enlarged, so that what its texels are too coarse to show stays
        change, cover = _resized(change, size), _resized(cover, size)
    result = (below + opacity * change).clip(0, 1)
    return np.where(cover > 0, result, below), opacity * cover[..., 0]


def _resized(picture: np.ndarray, size: int) -> np.ndarray:
    """Return [S, S, C] at another size: means of areas, or linear between texels, which never overshoots."""
    way = cv2.INTER_AREA if size < len(picture) else cv2.INTER_LINEAR
    result = cv2.resize(picture, (size, size), interpolation=way)
    return result if result.ndim == 3 else result[..., None]
