# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Coarse log-shading lifted to every pixel along the picture's own edges.

In each small window the shading is taken for an affine function of the picture's log colour (He, Sun and Tang, Guided
Image Filtering, 2013; fast form 2015): at a shadow's edge it follows the picture, on even skin it is a constant. The
guide has no pores, so none can pass into the shading.
"""

from __future__ import annotations

import cv2
import numpy as np

WINDOW_CELLS = 1  # radius, in cells of the coarse map
EDGE_LOG = 0.02  # natural log units: less variation in a window is skin and not an edge
PORE_SHARE, PORE_LOG = 0.006, 0.25  # share of the side, log units: finer and fainter detail is left out of the guide
WIDEST_PX = 6.0  # sigma of the widest filter, for a face of 1,000 pixels; its cost per pixel is its square


def lift_shading(shading: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Lift coarse log-shading [h, w, C] to the size of the picture that it covers, whose log is [H, W, C]."""
    guide = remove_pores(log)
    height, width = shading.shape[:2]
    small = cv2.resize(guide, (width, height), interpolation=cv2.INTER_AREA).reshape(shading.shape)
    slope, offset = _affine(small, shading)
    size = guide.shape[1::-1]
    slope, offset = (
        cv2.resize(grid, size, interpolation=cv2.INTER_LINEAR).reshape(guide.shape) for grid in (slope, offset)
    )
    return slope * guide + offset


def lift_share(share: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Lift a coarse share [h, w] in [0, 1], guided by luminance, to [H, W] in [0, 1]."""
    return np.clip(lift_shading(share[..., None].astype(np.float32), log.mean(-1, keepdims=True))[..., 0], 0, 1)


def remove_pores(log: np.ndarray) -> np.ndarray:
    """Smooth a log picture [H, W, C] where it varies finely and faintly; edges stay."""
    reach = max(1.0, PORE_SHARE * max(log.shape[:2]))
    return np.stack([_smooth(np.ascontiguousarray(log[..., k], np.float32), reach) for k in range(log.shape[-1])], -1)


def _smooth(channel: np.ndarray, reach: float) -> np.ndarray:
    """Smooth a channel [H, W] over `reach` pixels (sigma) but for its edges.

    If that is wide, only the finest detail is removed at full size; the rest of the change is smooth and computed at
    half the size.
    """
    if reach <= WIDEST_PX:
        return cv2.bilateralFilter(channel, -1, PORE_LOG, reach)
    fine = cv2.bilateralFilter(channel, -1, PORE_LOG, WIDEST_PX / 2)
    height, width = channel.shape
    half = cv2.resize(fine, ((width + 1) // 2, (height + 1) // 2), interpolation=cv2.INTER_AREA)
    return fine + cv2.resize(_smooth(half, reach / 2) - half, (width, height), interpolation=cv2.INTER_LINEAR)


def _affine(guide: np.ndarray, shading: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return per channel the slope and offset [h, w, C] from guide to shading, averaged over each cell's windows."""

    def mean(x: np.ndarray) -> np.ndarray:
        return cv2.blur(np.ascontiguousarray(x, np.float32), (2 * WINDOW_CELLS + 1,) * 2).reshape(x.shape)

    middle, level = mean(guide), mean(shading)
    variance, covariance = mean(guide * guide) - middle**2, mean(guide * shading) - middle * level
    slope = np.clip(covariance / (variance + EDGE_LOG**2), -0.2, 1.2)
    return mean(slope), mean(level - slope * middle)
