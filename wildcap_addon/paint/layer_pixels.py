# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers as arrays: laid over what is below, and told apart from it again.

An artist paints on the map itself, with whatever brushes Blender has; what differs from the map below is the layer.
Values are as the map's file stores them, float32 in [0, 1], rows in any order.
"""

import numpy as np

LEAST_CHANGE = 0.4 / 255
"""Difference from what is below from which a texel is painted; the tail of a soft brush is less."""
EDGE_SIDE_SHARE = 3 / 1024
"""Width of the edge along which a layer fades into what is below, as a share of the map's side."""


def resized(pixels: np.ndarray, size: int) -> np.ndarray:
    """Return a square map [S, S, C] at another size: the mean of whole texels, or linear between them."""
    side = len(pixels)
    if side == size:
        return pixels
    if side % size == 0:
        factor = side // size
        return pixels.reshape(size, factor, size, factor, -1).mean((1, 3), dtype=np.float32)
    at = np.clip((np.arange(size) + 0.5) / size * side - 0.5, 0, side - 1)
    low = np.minimum(at.astype(int), side - 2)
    share = (at - low).astype(np.float32)[:, None]
    rows = pixels[low] * (1 - share[..., None]) + pixels[low + 1] * share[..., None]
    return rows[:, low] * (1 - share) + rows[:, low + 1] * share


def resized_layer(layer: np.ndarray, size: int) -> np.ndarray:
    """Return a layer [S, S, 4] at another size; what it does not cover lends it no colour."""
    if len(layer) == size:
        return layer
    cover = resized(layer[..., 3:], size)
    colours = resized(layer[..., :3] * layer[..., 3:], size) / np.maximum(cover, 1e-6)
    return np.concatenate([colours, cover], -1)


def lay_over(below: np.ndarray, layer: np.ndarray, opacity: float = 1.0) -> np.ndarray:
    """Return what is below [S, S, 3] with a layer [S, S, 4] over it."""
    cover = opacity * layer[..., 3:]
    return below + cover * (layer[..., :3] - below)


def tell_layer(painted: np.ndarray, below: np.ndarray, edge: int) -> np.ndarray:
    """Return the layer [H, W, 4] that laid over what is below [H, W, 3] gives what was painted [H, W, 3].

    It covers what differs, and fades along its edge, so many texels wide, as far as the colours allow: a stroke with a
    hard edge stays hard, and a soft one still is when what is below changes later.
    """
    change = painted - below
    touched = np.abs(change).max(-1) >= LEAST_CHANGE
    inside = np.clip(2 * blurred(blurred(touched.astype(np.float32), edge), edge) - 1, 0, 1)
    # with less cover the layer's own colour would have to be brighter than white, or darker than black
    room = np.where(change > 0, 1 - below, below)
    needed = np.clip(np.abs(change) / np.maximum(room, 1e-6), 0, 1).max(-1)
    cover = np.where(touched, np.maximum(inside, needed), 0)[..., None]
    colours = np.clip(below + change / np.maximum(cover, 1e-6), 0, 1) * (cover > 0)
    return np.concatenate([colours, cover], -1).astype(np.float32)


def edge_width(side: int) -> int:
    """Return the width of a layer's fading edge in texels of a map of that side."""
    return max(1, round(EDGE_SIDE_SHARE * side))


def blurred(picture: np.ndarray, radius: int) -> np.ndarray:
    """Return [H, W(, C)] averaged over squares of 2 radius + 1; beyond the border it is 0."""
    for axis in (0, 1):
        width = [(radius + 1, radius) if each == axis else (0, 0) for each in range(picture.ndim)]
        total = np.pad(picture, width).cumsum(axis, dtype=np.float64)
        end, start = (np.take(total, range(*span), axis) for span in _spans(picture.shape[axis], radius))
        picture = ((end - start) / (2 * radius + 1)).astype(np.float32)
    return picture


def _spans(length: int, radius: int) -> tuple[tuple[int, int], tuple[int, int]]:
    return (2 * radius + 1, 2 * radius + 1 + length), (0, length)


def box_around(mask: np.ndarray, margin: int) -> tuple[slice, slice] | None:
    """Return rows and columns around what a mask [H, W] marks; None for nothing."""
    if not mask.any():
        return None
    return tuple(
        slice(max(0, int(marked[0]) - margin), min(length, int(marked[-1]) + 1 + margin))
        for marked, length in ((np.flatnonzero(mask.any(1 - axis)), mask.shape[axis]) for axis in (0, 1))
    )
