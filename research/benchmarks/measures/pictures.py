# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of one picture against its truth: PSNR, SSIM, FLIP, detail, and the rest of a shadow's step.

Pictures are sRGB float32 [H, W, 3] in [0, 1], masks bool [H, W]. The gain per channel, in linear light, takes out what
a skin tone would supply.
"""

import math

import cv2
import numpy as np
from flip_evaluator import evaluate as flip_evaluate
from skimage.metrics import structural_similarity

from core.imaging import images


def face_box(mask: np.ndarray) -> tuple[slice, slice]:
    """Return rows and columns about a mask [H, W], by a margin wider than any of the measures' filters."""
    return tuple(
        slice(max(side[0] - 40, 0), side[-1] + 41) for side in (np.flatnonzero(mask.any(axis)) for axis in (1, 0))
    )


def with_gain(predicted: np.ndarray, true: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return a picture with the gain per channel, in linear light, that gives it the truth's mean over the mask."""
    linear_true, linear = images.srgb_to_linear(true), images.srgb_to_linear(predicted)
    return images.linear_to_srgb(linear * (linear_true[mask].mean(0) / np.maximum(linear[mask].mean(0), 1e-6)))


def log_green(srgb: np.ndarray) -> np.ndarray:
    """Return the logarithm of linear green [H, W] of sRGB [H, W, 3]."""
    return np.log(np.maximum(images.srgb_to_linear(srgb)[..., 1], 1e-3))


def differences(predicted: np.ndarray, true: np.ndarray, mask: np.ndarray) -> dict:
    """Return PSNR in dB, SSIM and FLIP of sRGB pictures [H, W, 3] over a mask, both grey outside of it."""
    a, b = (np.where(mask[..., None], picture, 0.5).astype(np.float64) for picture in (predicted, true))
    error = ((a - b)[mask] ** 2).mean()
    _, ssim = structural_similarity(a, b, channel_axis=2, data_range=1.0, full=True)
    flip, _, _ = flip_evaluate(
        b.astype(np.float32), a.astype(np.float32), "LDR", applyMagma=False, computeMeanError=False
    )
    return {
        "psnr": float(-10 * np.log10(max(error, 1e-12))),
        "ssim": float(ssim[mask].mean()),
        "flip": float(np.squeeze(flip)[mask].mean()),
    }


def detail(log: np.ndarray, log_true: np.ndarray, mask: np.ndarray) -> float:
    """Return the correlation of two logarithms [H, W] between 1 and 3 px; 0 if the first is flat."""
    fine, inner = fine_bands(log, log_true, mask)
    return correlation(*(band[inner] for band in fine))


def fine_bands(log: np.ndarray, log_true: np.ndarray, mask: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the bands of both between 1 and 3 px, [H, W], and the pixels unaffected by the rest, bool [H, W]."""
    fine = []
    for picture in (log, log_true):
        picture = np.where(mask, picture, picture[mask].mean()).astype(np.float64)
        fine.append(cv2.GaussianBlur(picture, (0, 0), 1) - cv2.GaussianBlur(picture, (0, 0), 3))
    return fine, cv2.erode(mask.astype(np.uint8), np.ones((15, 15))) > 0


def correlation(one: np.ndarray, true: np.ndarray) -> float:
    """Return the correlation of values [N]; 0 if the first are alike."""
    return float(np.corrcoef(one, true)[0, 1]) if one.std() > 1e-9 else 0.0


def shadow_step(residual: np.ndarray, mask: np.ndarray, shadow: np.ndarray) -> float:
    """Return the median of log(predicted / true) [H, W] on the lit side of the shadow's edge less the dark.

    nan if the edge is too short.
    """
    sides = [residual[band & mask] for band in edge_bands(shadow)]
    return float(np.median(sides[0]) - np.median(sides[1])) if min(map(len, sides)) > 500 else math.nan


def edge_bands(shadow: np.ndarray) -> list[np.ndarray]:
    """Return the pixels 4 to 12 px from the edge of a shadow, bool [H, W]: on the lit side and on the dark one."""
    distances = [cv2.distanceTransform(side.astype(np.uint8), cv2.DIST_L2, 5) for side in (~shadow, shadow)]
    return [(distance > 4) & (distance < 12) for distance in distances]
