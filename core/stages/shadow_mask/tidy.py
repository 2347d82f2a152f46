# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From doubtful texels to a mask one can paint on: coherent, without specks, a little larger than the shadow, soft at
its edge."""

from __future__ import annotations

import cv2
import numpy as np

COHERENCE_LOG_ODDS = 4.0  # weight of the neighbourhood's opinion, in log odds
ACROSS_SIDE_SHARE = 0.015  # deviation over which skin tells of the brows, as a share of the map
SMALLEST_AREA_SHARE = 0.0003  # share of the map below which a region is a speck


def cohere(odds: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """bool [S, S]: log odds [S, S] made coherent by mean-field steps of a smoothness prior; nothing outside `inside`
    [S, S]."""
    size = len(odds)
    known = inside.astype(np.float32)
    share = 1 / (1 + np.exp(-odds))
    for _ in range(10):
        spread = cv2.GaussianBlur((share * known).astype(np.float32), (0, 0), 0.005 * size)
        around = spread / np.maximum(cv2.GaussianBlur(known, (0, 0), 0.005 * size), 1e-3)
        share = 1 / (1 + np.exp(-np.clip(odds + COHERENCE_LOG_ODDS * (2 * around - 1), -30, 30)))
    return (share > 0.5) & inside


def over_brows(share: np.ndarray, inside: np.ndarray, brows: np.ndarray) -> np.ndarray:
    """A share of shadow [S, S] with that of the skin around carried over the brows [S, S] in [0, 1], whose darkness
    passes for shadow in many a frame."""
    known = (inside & (brows < 0.1)).astype(np.float32)
    sigma = ACROSS_SIDE_SHARE * len(share)
    around = cv2.GaussianBlur(share * known, (0, 0), sigma) / np.maximum(cv2.GaussianBlur(known, (0, 0), sigma), 1e-4)
    return share + np.clip(2 * brows, 0, 1) * (around - share)


def tidy(mask: np.ndarray, inside: np.ndarray, dilate_px: float) -> np.ndarray:
    """Soft mask [S, S] in [0, 1] from a hard one: median filter, specks and pinholes gone, grown by `dilate_px`
    texels."""
    size = len(mask)
    mask = cv2.medianBlur(mask.astype(np.uint8), max(3, round(0.006 * size) | 1))
    mask = without_small(mask, SMALLEST_AREA_SHARE * size * size)
    mask = 1 - without_small(1 - mask, SMALLEST_AREA_SHARE * size * size)
    distance = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5) if mask.any() else np.full(mask.shape, np.inf)
    edge = max(1.5, 0.004 * size)
    return (np.clip((dilate_px + edge - distance) / edge, 0, 1) * inside).astype(np.float32)


def without_small(mask: np.ndarray, least: float) -> np.ndarray:
    """A mask [H, W] of 0 and 1 (uint8) without its regions of fewer than `least` pixels."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep[0] = False
    return keep[labels].astype(np.uint8)
