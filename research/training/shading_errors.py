# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Terms of the delighter's loss: errors [N, 3, S, S] of log-shadings, natural log, weights [N, 1, S, S]."""

from __future__ import annotations

import torch
from torch.nn import functional


def split_tone(error: torch.Tensor, weight: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Split an error into its mean over each map [N, 3, 1, 1] (exposure and skin tone) and the rest."""
    tone = (error * weight).sum((2, 3), keepdim=True) / weight.sum((2, 3), keepdim=True).clamp_min(1)
    return tone, error - tone


def mean_size(error: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Return the mean absolute error, a scalar."""
    return (error.abs() * weight).sum() / weight.sum().clamp_min(1) / error.shape[1]


def quantile_error(
    error: torch.Tensor, log_size: torch.Tensor, weight: torch.Tensor, share: float, least: float
) -> torch.Tensor:
    """Return the pinball loss of a size, a scalar: least where a `share` of the errors' magnitudes lies below it.

    error, log_size, weight [N, 1, S, S]; in the logarithm, from `least` on (Koenker and Bassett 1978).
    """
    over = (error.abs() + least).log() - log_size
    loss = torch.maximum(share * over, (share - 1) * over)
    return (loss * weight).sum() / weight.sum().clamp_min(1)


def slope_error(error: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Return how much the error changes over 1 to 8 pixels: remains of edges, and outlines."""
    total, slopes = weight.sum().clamp_min(1), 0.0
    for step in (1, 2, 4, 8):
        for axis in (2, 3):
            size = error.shape[axis]
            here, there = (torch.narrow(error, axis, first, size - step) for first in (0, step))
            both = torch.narrow(weight, axis, 0, size - step) * torch.narrow(weight, axis, step, size - step)
            slopes = slopes + ((there - here).abs() * both).sum() / total / 6
    return slopes / 4


def mean_deviation(error: torch.Tensor, weight: torch.Tensor) -> float:
    """Return the mean over the maps of the mean absolute error about each map's own mean, over all channels."""
    _, error = split_tone(error, weight)
    total = weight.sum((2, 3), keepdim=True).clamp_min(1)
    return ((error.abs() * weight).sum((2, 3), keepdim=True) / total).mean().item()


def without_coarse(error: torch.Tensor, weight: torch.Tensor, sigma: float) -> torch.Tensor:
    """Return what of an error is finer than a Gaussian of `sigma` pixels, by normalised convolution."""
    shrink = 4  # of the coarse part; divides the maps' side
    small = [functional.avg_pool2d(x, shrink) for x in (error * weight, weight)]
    reach = round(2.5 * sigma / shrink)
    kernel = torch.exp(-0.5 * (torch.arange(-reach, reach + 1, device=error.device) * shrink / sigma) ** 2)
    for shape, padding in (((1, 1, -1, 1), (reach, 0)), ((1, 1, 1, -1), (0, reach))):
        small = [
            functional.conv2d(x, kernel.view(shape).expand(x.shape[1], -1, -1, -1), padding=padding, groups=x.shape[1])
            for x in small
        ]
    mean = small[0] / small[1].clamp_min(1e-6)
    return error - functional.interpolate(mean, size=error.shape[2:], mode="bilinear", align_corners=False)
