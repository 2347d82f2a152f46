# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From doubtful texels to a mask one can paint on: coherent, without specks, a little larger than the shadow, soft at its edge."""

from __future__ import annotations

import cv2
import numpy as np

COHERENCE = 4.0  # weight of the neighbourhood's opinion, in log odds
SMALLEST = 0.0006  # share of the map below which a region is a speck


def cohere(odds: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """bool [S, S]: log odds [S, S] made coherent by mean-field steps of a smoothness prior; nothing outside `inside` [S, S]."""
    size = len(odds)
    known = inside.astype(np.float32)
    share = 1 / (1 + np.exp(-odds))
    for _ in range(10):
        around = cv2.GaussianBlur((share * known).astype(np.float32), (0, 0), 0.005 * size) / np.maximum(cv2.GaussianBlur(known, (0, 0), 0.005 * size), 1e-3)
        share = 1 / (1 + np.exp(-np.clip(odds + COHERENCE * (2 * around - 1), -30, 30)))
    return (share > 0.5) & inside


def tidy(mask: np.ndarray, inside: np.ndarray, dilate_px: float) -> np.ndarray:
    """Soft mask [S, S] in [0, 1] from a hard one: median filter, specks and pinholes gone, grown by `dilate_px` texels."""
    size = len(mask)
    window = max(3, round(0.006 * size) | 1)
    mask = cv2.medianBlur(mask.astype(np.uint8), window)
    mask = _without_small(mask, SMALLEST * size * size)
    mask = 1 - _without_small(1 - mask, SMALLEST * size * size)
    distance = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5) if mask.any() else np.full(mask.shape, np.inf)
    edge = max(1.5, 0.004 * size)
    return (np.clip((dilate_px + edge - distance) / edge, 0, 1) * inside).astype(np.float32)


def _without_small(mask: np.ndarray, least: float) -> np.ndarray:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep[0] = False
    return keep[labels].astype(np.uint8)
