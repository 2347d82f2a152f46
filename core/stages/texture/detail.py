# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the frames show that the texture is too coarse to hold: pores, the edges of moles, single hairs, as a band of
log luminance on a finer map.

Each view is read again at more texels along the warp that aligned it. What several views show alike is skin, what
differs between them is noise, so the band is shrunk by Wiener's factor, the share of it that the views agree on.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry import raster
from .projection import UnwrappedView

WORTH_PX_PER_TEXEL = 1.3
"""Pixels per texel of the texture from which a map twice as fine is worth its while; half of it, from twice as many,
one four times as fine."""
LARGEST_TEXELS = 4096
COARSE_SIGMA_TEXELS = 1.0
"""Sigma, in texels of the texture, of the blur that parts what it holds from what it does not."""
AROUND_SIGMA_TEXELS = 3.0
"""Sigma, in texels of the texture, of the neighbourhood over which agreement is judged."""
SHARP_EXPONENT = 2.0
"""Exponent of the views' weights: near the best view's own detail, yet of several."""


def fine_detail(
    observations: list[UnwrappedView], surface: Unfolded, texels: int, report: Reporter
) -> np.ndarray | None:
    """What the frames hold that is finer than the texture.

    Parameters
    ----------
    observations : of the views
    surface : of the head, unfolded at their size
    texels : side S of the texture
    report : hears of progress

    Returns
    -------
    float32 [F S, F S, 2]: the band of log luminance (natural), and Wiener's factor in [0, 1] that it is already
    multiplied by. None where the frames hold nothing finer, or fewer than two views see the head.
    """
    factor = finer(observations, texels)
    if factor == 1 or len(observations) < 2:
        return None
    size = factor * texels
    total, squares, weights, weights2 = (np.zeros((size, size), np.float32) for _ in range(4))
    for observation in observations:
        report.progress(len(observations) + 4, len(observations) + 6, f"fine detail of {observation.name}")
        weight = cv2.resize(observation.weight, (size, size), interpolation=cv2.INTER_LINEAR) ** SHARP_EXPONENT
        pixels = cv2.resize(
            raster.bleed(observation.pixels, surface.covered), (size, size), interpolation=cv2.INTER_LINEAR
        )
        grey = observation.picture.log_colours(pixels).mean(-1)
        band = grey - cv2.GaussianBlur(grey, (0, 0), COARSE_SIGMA_TEXELS * factor)
        total += weight * band
        squares += weight * band**2
        weights += weight
        weights2 += weight**2
    mean = total / np.maximum(weights, 1e-9)
    views = weights**2 / np.maximum(weights2, 1e-12)  # how many views count, in effect
    seen = (views > 1.2) & (cv2.resize(surface.covered.astype(np.float32), (size, size)) > 0.99)

    def around(image: np.ndarray) -> np.ndarray:
        sigma = AROUND_SIGMA_TEXELS * factor
        spread = cv2.GaussianBlur(image * seen, (0, 0), sigma)
        return spread / np.maximum(cv2.GaussianBlur(seen.astype(np.float32), (0, 0), sigma), 1e-6)

    # variance of the mean
    noise = np.maximum(squares / np.maximum(weights, 1e-9) - mean**2, 0) / np.maximum(views - 1, 0.2)
    agreed = np.clip(1 - around(noise) / np.maximum(around(mean**2), 1e-9), 0, 1) * seen
    return np.stack([mean * agreed, agreed], -1).astype(np.float32)


def finer(observations: list[UnwrappedView], texels: int) -> int:
    """1, 2 or 4: how many texels of a side the frames can fill where a texture of `texels` has one, judged where each
    view sees the head best."""
    density = []
    for observation in observations:
        across, down = (np.gradient(observation.pixels, axis=axis) for axis in (1, 0))
        area = np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])  # pixels per texel
        best = observation.weight > 0.5 * observation.weight.max(initial=0)
        if best.any():
            density.append(np.sqrt(np.median(area[best])))
    most = float(np.median(density)) * len(observations[0].weight) / texels if density else 0.0
    factor = 1 if most < WORTH_PX_PER_TEXEL else 2 if most < 2 * WORTH_PX_PER_TEXEL else 4
    return max(1, min(factor, LARGEST_TEXELS // texels))
