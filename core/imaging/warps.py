# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the maps of one surface that several views give have to move to lie on each other: a smooth warp of each onto the others' consensus.

After Zhou and Koltun, "Color Map Optimization for 3D Reconstruction with Consumer Depth Cameras" (2014), with dense
optical flow (DIS) in UV space in the place of their control lattice.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from .averages import blurred, weighted_mean

ROUNDS = 2
LONGEST = 10 / 1024
"""Longest warp, as a part of the map's side."""
SMOOTH = 24 / 1024
"""Gaussian sigma of the warp's smoothing, as a part of the map's side."""


def find_warps(read: Callable[[int, np.ndarray | None], np.ndarray], weights: list[np.ndarray],
               told: Callable[[float, int], None] = lambda share, view: None) -> list[np.ndarray]:
    """For each view a float32 [S, S, 2] in texels: what belongs at texel x is what the view's map shows at x + warp(x).

    read(view, warp) is a view's log colour [S, S, 3] along a warp, None being none; weights [S, S] say how well each view sees what. `told` gets the share of
    the work that is done, and the view that comes next.
    """
    warps = [np.zeros((*weight.shape, 2), np.float32) for weight in weights]
    for step in range(ROUNDS):
        details = [_detail(read(i, warp if step else None), weight) for i, (warp, weight) in enumerate(zip(warps, weights, strict=True))]
        consensus = weighted_mean(details, (weight**3 for weight in weights))
        for i, (warp, detail, weight) in enumerate(zip(warps, details, weights, strict=True)):
            told((step + i / len(warps)) / ROUNDS, i)
            warp += _flow(consensus, detail, weight)
        del details
        drift = weighted_mean(warps, weights)
        for warp in warps:
            warp -= drift  # the views may move against each other, not what they show over the surface
            _limit(warp)
    return warps


def moved(values: np.ndarray, warp: np.ndarray) -> np.ndarray:
    """values(x + warp(x)) of maps [S, S(, C)]: what belongs at texel x by that warp."""
    y, x = np.mgrid[0:len(warp), 0:len(warp)].astype(np.float32)
    return cv2.remap(values, x + warp[..., 0], y + warp[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def _detail(log_colour: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """[S, S] band-passed log luminance of [S, S, 3] where weight [S, S] is positive: what can be matched whatever the light."""
    grey = log_colour.mean(-1)
    seen = (weight > 0).astype(np.float32)
    size = len(grey)
    return (blurred(grey, seen, size / 1024) - blurred(grey, seen, 10 * size / 1024)) * seen


def _flow(consensus: np.ndarray, detail: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Smooth float32 [S, S, 2] with consensus(x) = detail(x + warp(x)), decided by where weight [S, S] is large and there is something to see."""
    trust = np.clip(weight / max(np.percentile(weight[weight > 0], 80) if (weight > 0).any() else 1, 1e-9), 0, 1)
    spread = max(float(consensus[trust > 0.2].std()) if (trust > 0.2).any() else 0.0, 1e-4)
    first, second = ((128 + 127 * np.tanh(trust * image / (3 * spread))).astype(np.uint8) for image in (consensus, detail))
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    dis.setFinestScale(1)
    raw = dis.calc(first, second, None)
    scale = len(consensus) / 1024
    contrast = cv2.GaussianBlur(np.abs(consensus), (0, 0), 6 * scale) / spread
    sure = trust * np.minimum(contrast, 2) + 1e-4
    return blurred(raw, sure, SMOOTH * len(consensus)).astype(np.float32)


def _limit(warp: np.ndarray) -> None:
    """Shortens in place what is longer than LONGEST."""
    length = np.sqrt((warp**2).sum(-1, keepdims=True))
    warp *= np.minimum(1, LONGEST * len(warp) / np.maximum(length, 1e-6))
