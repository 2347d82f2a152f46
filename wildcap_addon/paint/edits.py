# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the mask's buttons do to it: arrays in, arrays out, float32 [H, W] in [0, 1]."""

import numpy as np

STEP_SIDE_SHARE = 4 / 1024
"""How far one click grows or shrinks the mask, as a part of the map's side."""


def grow(mask: np.ndarray) -> np.ndarray:
    """The mask, wider by a few texels on every side."""
    for i in range(max(1, round(STEP_SIDE_SHARE * len(mask)))):
        mask = _widened(mask, corners=i % 2 == 1)
    return mask


def shrink(mask: np.ndarray) -> np.ndarray:
    """The mask, narrower by as much."""
    return 1 - grow(1 - mask)


def soften(mask: np.ndarray) -> np.ndarray:
    """Borders faded over a few texels: the mean of the mask grown and shrunk, step by step."""
    total, count = mask.astype(np.float32), 1
    wide = narrow = mask
    for i in range(max(1, round(STEP_SIDE_SHARE * len(mask)))):
        wide, narrow = _widened(wide, i % 2 == 1), 1 - _widened(1 - narrow, i % 2 == 1)
        total, count = total + wide + narrow, count + 2
    return total / count


def invert(mask: np.ndarray) -> np.ndarray:
    """Shadow where there was none, and none where it was."""
    return 1 - mask


def clear(mask: np.ndarray) -> np.ndarray:
    """No shadow anywhere."""
    return np.zeros_like(mask)


def mirror(mask: np.ndarray) -> np.ndarray:
    """What is masked on one side is masked on the other, too: the head's UVs are symmetric about u = 0.5."""
    return np.maximum(mask, mask[:, ::-1])


def _widened(mask: np.ndarray, corners: bool) -> np.ndarray:
    """The largest value among a texel and its four neighbours, or eight with `corners`: in turn they make a round
    shape."""
    out = mask.copy()
    for axis in (0, 1):
        source = out if corners else mask
        shifted = np.moveaxis(source, axis, 0)
        view = np.moveaxis(out, axis, 0)
        before, after = shifted[:-1].copy(), shifted[1:].copy()
        np.maximum(view[1:], before, out=view[1:])
        np.maximum(view[:-1], after, out=view[:-1])
    return out
