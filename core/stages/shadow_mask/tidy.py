# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From doubtful texels to a paintable mask: coherent, without specks, a little larger than the shadow, soft-edged."""

from __future__ import annotations

import cv2
import numpy as np

from ...imaging.normalized_convolution import weighted_blur

COHERENCE_LOG_ODDS = 4.0  # weight of the neighbourhood's opinion, in log odds
ACROSS_SIDE_SHARE = 0.015  # deviation over which skin is carried over the brows, as a share of the map
SMALLEST_AREA_SHARE = 0.0003  # share of the map below which a region is a speck


def cohere(odds: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Make log odds [S, S] coherent by mean-field steps of a smoothness prior; bool [S, S], False outside `inside`."""
    share = 1 / (1 + np.exp(-odds))
    for _ in range(10):
        around = weighted_blur(share, inside, 0.005 * len(odds), 1e-3)
        share = 1 / (1 + np.exp(-np.clip(odds + COHERENCE_LOG_ODDS * (2 * around - 1), -30, 30)))
    return (share > 0.5) & inside


def over_brows(share: np.ndarray, inside: np.ndarray, brows: np.ndarray) -> np.ndarray:
    """Carry the shadow share [S, S] of the skin around over the brows [S, S] in [0, 1], which look dark by nature."""
    around = weighted_blur(share, inside & (brows < 0.1), ACROSS_SIDE_SHARE * len(share), 1e-4)
    return share + np.clip(2 * brows, 0, 1) * (around - share)


def tidy(mask: np.ndarray, inside: np.ndarray, dilate_px: float) -> np.ndarray:
    """Return a soft mask [S, S] in [0, 1] from a hard one, without specks and pinholes, grown by `dilate_px` texels."""
    size = len(mask)
    mask = cv2.medianBlur(mask.astype(np.uint8), max(3, round(0.006 * size) | 1))
    mask = without_small_regions(mask, SMALLEST_AREA_SHARE * size * size)
    distance = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5) if mask.any() else np.full(mask.shape, np.inf)
    edge = max(1.5, 0.004 * size)
    return (np.clip((dilate_px + edge - distance) / edge, 0, 1) * inside).astype(np.float32)


def without_small_regions(mask: np.ndarray, least: float) -> np.ndarray:
    """Remove regions of fewer than `least` pixels, then holes of that size, from a mask [H, W] of 0 and 1 (uint8)."""
    for _ in range(2):  # the second time on the inverted mask
        _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        keep = stats[:, cv2.CC_STAT_AREA] >= least
        keep[0] = False
        mask = 1 - keep[labels].astype(np.uint8)
    return mask
