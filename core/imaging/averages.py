# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of pictures over where there is something: of neighbours, and of several pictures."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np


def blurred(image: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian mean of [S, S(, C)] over where weight [S, S] >= 0 says there is something (normalised convolution); large sigmas at lower resolution."""
    height, width = weight.shape
    factor = max(1, int(sigma // 4))
    weighted = image * (weight if image.ndim == 2 else weight[..., None])
    if factor > 1:
        small = max(1, width // factor), max(1, height // factor)
        weighted, weight = (cv2.resize(x, small, interpolation=cv2.INTER_AREA) for x in (weighted, weight))
    top, bottom = (cv2.GaussianBlur(x, (0, 0), sigma / factor) for x in (weighted, weight))
    mean = top / np.maximum(bottom if image.ndim == 2 else bottom[..., None], 1e-8)
    return cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR) if factor > 1 else mean


def weighted_mean(images: Iterable[np.ndarray], weights: Iterable[np.ndarray]) -> np.ndarray:
    """Mean over views of [S, S(, C)] with weights [S, S]; zero where all weights are."""
    top, bottom = 0.0, 1e-12
    for image, weight in zip(images, weights, strict=True):
        weight = weight if image.ndim == 2 else weight[..., None]
        top, bottom = top + image * weight, bottom + weight
    return top / bottom
