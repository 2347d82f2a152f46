# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Share of the light that is missing inside of M, measured at its border.

A shadow's edge crosses the skin at random, so what differs on its two sides is light. Inside a shadow darker skin and
less light look the same; at its edge they do not. The steps along the border hold for some way inwards, less the
farther in and the shorter that border is.

But a border may run along a beard, whose steps are of all sizes. Steps that a delighter left deviate by LEFT_LOG along
a border, whatever the capture; any more is the skin's own. With both taken for Gaussians the light's share of each step
is LEFT_LOG^2 over the variance (Wiener 1949).
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
# research/benchmarks/light/shadow_steps.py
LEFT_LOG = 0.14


def measure_missing_light(light: torch.Tensor, alpha: torch.Tensor, weight: torch.Tensor, texel: float) -> torch.Tensor:
    """Return the share of the light [S, S] that is missing under M = 1, 0 where no border is near.

    light [3, S, S]: texture over (reference albedo x global shading), linear, about 1 where lit; alpha [S, S]: M;
    weight [S, S]: how much a texel reveals of the light, 0 off the facial skin, whose outline is no border; texel: its
    side in texels of a 1024 map.
    """
    value = np.log(np.clip(light.numpy(), 0.05, 4)).mean(0).astype(np.float32)
    steps, sure = measure_border_steps(value, alpha.numpy(), weight.numpy(), texel)
    step = _blurred(-sure * steps, INWARDS_TEXELS / texel) / (_blurred(sure, INWARDS_TEXELS / texel) + MIN_BORDER_SHARE)
    share = 1 - np.exp(-np.maximum(estimate_light_share(steps, sure) * step, 0))
    return torch.from_numpy(share.clip(0, MAX_MISSING_SHARE).astype(np.float32))


def measure_border_steps(
    log_light: np.ndarray, alpha: np.ndarray, weight: np.ndarray, texel: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps [S, S] of the light's logarithm from outside of M to inside, and their certainty [S, S].

    log_light [S, S] is the mean of the channels; the rest is as in `measure_missing_light`. The certainty is 0 away
    from the border.
    """
    inside = alpha > 0.5
    if not inside.any() or inside.all():
        return np.zeros_like(log_light), np.zeros_like(log_light)
    depth = signed_distance(inside) * texel  # negative inside
    near = weight * np.clip(1.5 - np.abs(np.abs(depth) - SIDE_TEXELS) / BAND_TEXELS, 0, 1) * (np.abs(depth) > 2)
    means, shares = [], []
    for side in (depth < 0, depth > 0):
        share = _blurred(near * side, WINDOW_TEXELS / texel)
        means.append(_blurred(near * side * log_light, WINDOW_TEXELS / texel) / np.maximum(share, 1e-4))
        shares.append(share)
    sure = np.minimum(*shares) * (np.abs(depth) < REACH_TEXELS)
    return means[0] - means[1], np.where(sure > 0.02, sure / max(float(sure.max()), 1e-6), 0)


def estimate_light_share(steps: np.ndarray, sure: np.ndarray) -> float:
    """Return the share in (0, 1] of `measure_border_steps`'s steps that is light and not skin."""
    return LEFT_LOG**2 / max(mean_and_deviation(steps, sure)[1] ** 2, LEFT_LOG**2)


def mean_and_deviation(samples: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Return the mean and deviation of samples [S, S] under a weight [S, S]; zeros without any."""
    total = max(float(weight.sum()), 1e-6)
    mean = float((weight * samples).sum()) / total
    return mean, (float((weight * (samples - mean) ** 2).sum()) / total) ** 0.5


def _blurred(image: np.ndarray, sigma: float) -> np.ndarray:
    return cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
