# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Holes of a texture, filled: inside the charts by push-pull (Gortler et al. 1996), outside by the nearest texel."""

from __future__ import annotations

import cv2
import numpy as np

from ...geometry import raster

TRUSTED_CONFIDENCE = 0.1  # texels above keep their colour


def fill(texture: np.ndarray, confidence: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Fill the holes of a linear texture [S, S, 3] with confidence [S, S] in [0, 1]."""
    trust = np.clip(confidence / TRUSTED_CONFIDENCE, 0, 1).astype(np.float32)
    smooth = _push_pull(texture * trust[..., None], trust)
    filled = texture * trust[..., None] + smooth * (1 - trust[..., None])
    return raster.bleed(filled.astype(np.float32), covered)


def _push_pull(weighted: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return [h, w, 3] from values times weight and weight [h, w]: coarser means take over as the weight falls to 0."""
    mean = weighted / np.maximum(weight, 1e-6)[..., None]
    height, width = weight.shape
    if min(height, width) <= 2:
        overall = weighted.sum((0, 1)) / max(weight.sum(), 1e-6)
        return np.where(weight[..., None] > 1e-6, mean, overall).astype(np.float32)
    half = (width + 1) // 2, (height + 1) // 2
    down = [cv2.resize(x, half, interpolation=cv2.INTER_AREA) for x in (weighted, weight)]
    gain = np.minimum(4 * down[1], 1) / np.maximum(down[1], 1e-6)  # one trusted texel of four is enough
    coarse = _push_pull(down[0] * gain[..., None], down[1] * gain)
    coarse = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)
    kept = np.minimum(weight, 1)[..., None]
    return (mean * kept + coarse * (1 - kept)).astype(np.float32)
