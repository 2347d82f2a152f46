# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of many heads at once in the built-in head's UVs, float32 [N, channels, S, S] on any device: what is spread over
them, blurred and moved."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch
from torch.nn import functional

from ..face import template
from ..synthetic.unfolded import SIDE, template_raster
from .dice import Dice

TEXEL_MM = 0.8
"""Of a map of SIDE, in the face."""


def at_texels(values: torch.Tensor, side: int) -> torch.Tensor:
    """Per-vertex values [N, V, C] as maps [N, C, S, S]."""
    corners, bary = _raster(side, values.device)
    texels = sum(values[:, corners[:, k]] * bary[:, k:k + 1] for k in range(3))
    return texels.transpose(1, 2).reshape(len(values), -1, side, side)


@cache
def _raster(side: int, device: torch.device) -> tuple[torch.Tensor, torch.Tensor]:
    """The vertices [S * S, 3] between which each texel of the built-in head lies, and their weights."""
    face, bary = template_raster(side)  # every texel is of the head
    return (torch.from_numpy(template.load().faces[face].reshape(-1, 3)).long().to(device),
            torch.from_numpy(bary.reshape(-1, 3)).float().to(device))


@cache
def face_mask(side: int, device: torch.device) -> torch.Tensor:
    return torch.from_numpy(template.mask("face", side)).float().to(device)


def mean_over(maps: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    return (maps * weight).sum((2, 3), keepdim=True) / weight.sum((2, 3), keepdim=True).clamp_min(1e-6)


def blurred(maps: torch.Tensor, sigma: np.ndarray) -> torch.Tensor:
    """Maps [N, C, S, S] under Gaussians of deviations [N, C] or [N, 1] in texels."""
    n, c, side, _ = maps.shape
    sigma = np.broadcast_to(sigma, (n, c)).reshape(-1, 1)
    reach = max(1, int(np.ceil(3 * sigma.max())))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel = torch.as_tensor(kernel / kernel.sum(1, keepdims=True), dtype=maps.dtype, device=maps.device)
    flat = functional.pad(maps.reshape(1, n * c, side, side), [reach] * 4, mode="reflect")
    flat = functional.conv2d(flat, kernel[:, None, None], groups=n * c)
    return functional.conv2d(flat, kernel[:, None, :, None], groups=n * c).reshape(n, c, side, side)


def moved(maps: torch.Tensor, reach_mm: torch.Tensor, dice: Dice) -> torch.Tensor:
    """Maps [N, C, S, S] under a smooth random displacement whose deviation is `reach_mm` [N]."""
    n, side = len(maps), maps.shape[-1]
    texels = reach_mm[:, None, None, None] / TEXEL_MM * side / SIDE
    far = grown(dice.noise(n, 2, 6, 6) * texels, side).movedim(1, -1)
    y, x = torch.meshgrid(*2 * [torch.arange(side, device=maps.device, dtype=torch.float32)], indexing="ij")
    at = (torch.stack([x, y], -1) + far + 0.5) * (2 / side) - 1
    return functional.grid_sample(maps, at, padding_mode="border", align_corners=False)


def grown(maps: torch.Tensor, side: int) -> torch.Tensor:
    return functional.interpolate(maps, size=(side, side), mode="bicubic", align_corners=False)


def resized(maps: torch.Tensor, side: int) -> torch.Tensor:
    return maps if maps.shape[-1] == side else functional.adaptive_avg_pool2d(maps, side)


def bits(packed: torch.Tensor) -> torch.Tensor:
    """uint8 [..., K] as numpy.packbits leaves them -> float32 [..., 8 K]."""
    places = torch.arange(7, -1, -1, device=packed.device, dtype=torch.uint8)
    return ((packed[..., None] >> places) & 1).flatten(-2).float()


def on_device(device: torch.device, values) -> torch.Tensor:
    return torch.as_tensor(np.asarray(values, np.float32), device=device)


def unit(vectors: torch.Tensor, axis: int = 1) -> torch.Tensor:
    return vectors / vectors.norm(dim=axis, keepdim=True).clamp_min(1e-6)
