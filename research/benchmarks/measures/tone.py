# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Gain per channel that removes the tone, and PSNR after it, on lists of texels."""

import numpy as np

from core.imaging import images

BEST_PSNR = 60.0
"""PSNR of two equal pictures, in dB, and of all that differ by less than eight bits can tell: a mean over people stays
one."""


def to_tone(answer: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return linear [N, 3] with the gain per channel that makes its mean `tone` [3]."""
    return answer * (np.asarray(tone) / np.maximum(answer.mean(0), 1e-6))


def squared_error(answer: np.ndarray, truth: np.ndarray) -> float:
    """Return the mean squared sRGB difference of linear colours [N, 3]."""
    one, other = (
        images.linear_to_srgb(np.asarray(values, np.float32)).astype(np.float64) for values in (answer, truth)
    )
    return float(((one - other) ** 2).mean())


def to_decibels(error: float) -> float:
    """Return the PSNR of a mean squared error against a peak of 1, at most BEST_PSNR."""
    return float(-10 * np.log10(max(error, 10 ** (-BEST_PSNR / 10))))


def psnr_after_gain(answer: np.ndarray, truth: np.ndarray) -> float:
    """Return the PSNR in dB (sRGB) of linear colours [N, 3] after the gain to the truth's mean."""
    return to_decibels(squared_error(to_tone(answer, truth.mean(0)), truth))
