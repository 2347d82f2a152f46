# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Normalised convolution (Knutsson and Westin 1993): a Gaussian mean of only those pixels that count."""

from __future__ import annotations

import cv2
import numpy as np


def weighted_blur(
    image: np.ndarray,
    weight: np.ndarray,
    sigma: float,
    floor: float = 1e-6,
    shrink: int = 1,
    border: int = cv2.BORDER_DEFAULT,
) -> np.ndarray:
    """Return blur(image * weight) / blur(weight), [H, W(, C)], for a weight [H, W] >= 0 or bool.

    The blurred weight is at least `floor`, so the result fades to 0 where nothing counts nearby. Wide blurs are cheaper
    at 1 / `shrink` of the size. The border is one of OpenCV's.
    """
    weight = np.asarray(weight, np.float32)
    weighted = np.asarray(np.atleast_3d(image) * weight[..., None], np.float32)
    height, width = weight.shape
    if shrink > 1:
        small = max(width // shrink, 1), max(height // shrink, 1)
        weighted, weight = (cv2.resize(x, small, interpolation=cv2.INTER_AREA) for x in (weighted, weight))
    top, bottom = (cv2.GaussianBlur(x, (0, 0), sigma / shrink, borderType=border) for x in (weighted, weight))
    mean = top.reshape(*bottom.shape, -1) / np.maximum(bottom, floor)[..., None]
    if shrink > 1:
        mean = cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
    return mean.reshape(image.shape)
