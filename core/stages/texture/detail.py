# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detail that the texture is too coarse for: pores, the edges of moles, single hairs, as a band of log luminance.

Each view is read again at more texels along the warp that aligned it. What several views show alike is skin, what
differs between them is noise, so the band is shrunk by Wiener's factor, the share of it that the views agree on.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry import raster
from ...imaging.normalized_convolution import weighted_blur
from .projection import UnwrappedView

WORTH_PX_PER_TEXEL = 1.3  # pixels per texel that make a map twice as fine worthwhile; twice as many: four times as fine
LARGEST_TEXELS = 4096
COARSE_SIGMA_TEXELS = 1.0  # of the blur, in texels of the texture, that separates what it holds from what it does not
AROUND_SIGMA_TEXELS = 3.0  # of the neighbourhood, in texels of the texture, over which agreement is judged
SHARP_EXPONENT = 2.0  # of the views' weights: near the best view's own detail, yet of several


def fine_detail(
    observations: list[UnwrappedView], surface: Unfolded, texels: int, report: Reporter
) -> np.ndarray | None:
    """Return what the frames hold that is finer than a texture of `texels` along a side, float32 [F S, F S, 2].

    The channels are the band of log luminance (natural) and Wiener's factor in [0, 1], by which it is already
    multiplied. None if the frames hold nothing finer, or fewer than two views see the head.
    """
    factor = finer(observations, texels)
    if factor == 1 or len(observations) < 2:
        return None
    size = factor * texels

    def enlarge(image: np.ndarray) -> np.ndarray:
        return cv2.resize(image, (size, size), interpolation=cv2.INTER_LINEAR)

    total, squares, weights, weights2 = (np.zeros((size, size), np.float32) for _ in range(4))
    for observation in observations:
        report.progress(len(observations) + 4, len(observations) + 6, f"fine detail of {observation.name}")
        weight = enlarge(observation.weight) ** SHARP_EXPONENT
        pixels = enlarge(raster.bleed(observation.pixels, surface.covered))
        grey = observation.picture.log_colours(pixels).mean(-1)
        band = grey - cv2.GaussianBlur(grey, (0, 0), COARSE_SIGMA_TEXELS * factor)
        total += weight * band
        squares += weight * band**2
        weights += weight
        weights2 += weight**2
    mean = total / np.maximum(weights, 1e-9)
    views = weights**2 / np.maximum(weights2, 1e-12)  # effective number of views
    shared = (views > 1.2) & (enlarge(surface.covered.astype(np.float32)) > 0.99)
    variance = np.maximum(squares / np.maximum(weights, 1e-9) - mean**2, 0) / np.maximum(views - 1, 0.2)  # of the mean
    noise, power = (weighted_blur(each, shared, AROUND_SIGMA_TEXELS * factor) for each in (variance, mean**2))
    agreed = np.clip(1 - noise / np.maximum(power, 1e-9), 0, 1) * shared
    return np.stack([mean * agreed, agreed], -1).astype(np.float32)


def finer(observations: list[UnwrappedView], texels: int) -> int:
    """Return 1, 2 or 4: how many times finer than a texture of `texels` a map may be that the frames still fill.

    It is judged where each view sees the head best.
    """
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
