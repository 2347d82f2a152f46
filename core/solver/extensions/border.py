# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light is missing inside of M, as its border tells: a shadow's edge crosses the skin at random, so what
differs on its two sides is light.

Inside a shadow a darker skin and a lesser light look the same; at its edge they do not. What the steps along the border
say holds for some way inwards, less the farther in and the shorter the border is that says it.

But a border may run along a beard, whose steps are of all sizes. Those that a delighter left differ along a border by
LEFT_LOG, whatever the capture; what they differ by more than that is skin's own, and with both taken for Gaussians the
light's share of each step is LEFT_LOG^2 over the variance (Wiener 1949).
"""

from __future__ import annotations

import cv2
import numpy as np
import torch

from ...light.shadow_edges import signed_distance

# in texels of a 1024 map
# the two sides are compared over bands about this distance from the border: a penumbra lies between; half width of a
# band
SIDE_TEXELS, BAND_TEXELS = 9.0, 8.0
REACH_TEXELS = 14.0  # how far from the border a step is read
WINDOW_TEXELS = 8.0  # deviation of the windows over which a side is averaged
INWARDS_TEXELS = 40.0  # deviation over which a step holds for what is around it
MIN_BORDER_SHARE = 0.05  # share of a window of INWARDS_TEXELS that border must fill, for its step to hold by half
MAX_MISSING_SHARE = 0.9  # more of the light than this never goes
# deviation, along M's border, of the step in the light that a delighter left, natural log:
# research/benchmarks/shadow_steps.py
LEFT_LOG = 0.14


def measure_missing_light(light: torch.Tensor, alpha: torch.Tensor, weight: torch.Tensor, texel: float) -> torch.Tensor:
    """The share of the light that is missing under M = 1, by the steps along M's border.

    Parameters
    ----------
    light : [3, S, S], texture over (reference albedo x global shading), linear, about 1 where lit
    alpha : [S, S] in [0, 1], M
    weight : [S, S] in [0, 1], how far a texel tells of light; 0 off the facial skin, so that the outline of the face is
        no border
    texel : side of a texel in texels of a 1024 map

    Returns
    -------
    [S, S] in [0, MAX_MISSING_SHARE]; 0 where no border is near.
    """
    value = np.log(np.clip(light.numpy(), 0.05, 4)).mean(0).astype(np.float32)
    steps, sure = measure_border_steps(value, alpha.numpy(), weight.numpy(), texel)
    step = _blurred(-sure * steps, INWARDS_TEXELS / texel) / (_blurred(sure, INWARDS_TEXELS / texel) + MIN_BORDER_SHARE)
    share = 1 - np.exp(-np.maximum(estimate_light_share(steps, sure) * step, 0))
    return torch.from_numpy(share.clip(0, MAX_MISSING_SHARE).astype(np.float32))


def measure_border_steps(
    log_light: np.ndarray, alpha: np.ndarray, weight: np.ndarray, texel: float
) -> tuple[np.ndarray, np.ndarray]:
    """By how much the light's logarithm is larger inside of M than outside, at the places of M's border.

    Parameters
    ----------
    log_light : [S, S], natural log, mean of the channels
    alpha, weight, texel : as in `measure_missing_light`

    Returns
    -------
    The steps [S, S] and how surely each is known [S, S] in [0, 1], 0 away from the border.
    """
    inside = alpha > 0.5
    if not inside.any() or inside.all():
        return np.zeros_like(log_light), np.zeros_like(log_light)
    depth = signed_distance(inside) * texel  # negative inside
    near = weight * np.clip(1.5 - np.abs(np.abs(depth) - SIDE_TEXELS) / BAND_TEXELS, 0, 1) * (np.abs(depth) > 2)
    sides, known = [], []
    for side in (depth < 0, depth > 0):
        share = _blurred(near * side, WINDOW_TEXELS / texel)
        sides.append(_blurred(near * side * log_light, WINDOW_TEXELS / texel) / np.maximum(share, 1e-4))
        known.append(share)
    sure = np.minimum(*known) * (np.abs(depth) < REACH_TEXELS)
    return sides[0] - sides[1], np.where(sure > 0.02, sure / max(float(sure.max()), 1e-6), 0)


def estimate_light_share(steps: np.ndarray, sure: np.ndarray) -> float:
    """The share in (0, 1] of the steps of `measure_border_steps` that is light, and no skin."""
    return LEFT_LOG**2 / max(mean_and_deviation(steps, sure)[1] ** 2, LEFT_LOG**2)


def mean_and_deviation(samples: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Mean and deviation of samples [S, S] under a weight [S, S]; zeros without any."""
    total = max(float(weight.sum()), 1e-6)
    mean = float((weight * samples).sum()) / total
    return mean, (float((weight * (samples - mean) ** 2).sum()) / total) ** 0.5


def _blurred(image: np.ndarray, sigma: float) -> np.ndarray:
    return cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
