# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a whole mask, float32 [H, W] in [0, 1]."""

import numpy as np

STEP_SIDE_SHARE = 4 / 1024
"""Distance by which a click grows or shrinks the mask, as a share of the map's side."""


def grow(mask: np.ndarray) -> np.ndarray:
    """Widen the mask by a few texels on every side."""
    for i in range(_steps(mask)):
        mask = _widened(mask, corners=i % 2 == 1)
    return mask


def shrink(mask: np.ndarray) -> np.ndarray:
    """Narrow the mask by as much."""
    return 1 - grow(1 - mask)


def soften(mask: np.ndarray) -> np.ndarray:
    """Fade the borders over a few texels: the mean of the mask grown and shrunk, step by step."""
    total, count = mask.astype(np.float32), 1
    wide = narrow = mask
    for i in range(_steps(mask)):
        wide, narrow = _widened(wide, i % 2 == 1), 1 - _widened(1 - narrow, i % 2 == 1)
        total, count = total + wide + narrow, count + 2
    return total / count


def invert(mask: np.ndarray) -> np.ndarray:
    """Swap shadow and light."""
    return 1 - mask


def clear(mask: np.ndarray) -> np.ndarray:
    """Return a mask without shadow."""
    return np.zeros_like(mask)


def mirror(mask: np.ndarray) -> np.ndarray:
    """Mask on each side what is masked on the other: the head's UVs are symmetric about u = 0.5."""
    return np.maximum(mask, mask[:, ::-1])


def _steps(mask: np.ndarray) -> int:
    return max(1, round(STEP_SIDE_SHARE * len(mask)))


def _widened(mask: np.ndarray, corners: bool) -> np.ndarray:
    """Return the maximum of a texel and its four neighbours, or eight with `corners`; alternating rounds a shape."""
    rows = np.pad(mask, ((1, 1), (0, 0)), mode="edge")
    tall = np.maximum(np.maximum(rows[:-2], rows[2:]), mask)
    columns = np.pad(tall if corners else mask, ((0, 0), (1, 1)), mode="edge")
    return np.maximum(np.maximum(columns[:, :-2], columns[:, 2:]), tall)
