# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighting network in the head's own UV space: from what all views saw of each texel to its log-shading, and how
sure that is.

The shading has the form of the light that was fitted to the skin: sky, and as much of the sun as nothing blocks. Which
share that is the network tells texel by texel, and what the fit gets wrong over cells of four: so a shadow's border is
as fine as the map, and all else too coarse to follow hairs, small moles or pores. A U-Net whose deepest map, 16 texels
wide, attends to all of itself: one half of a face tells the light on the other. Its finest level, where maps are large,
is kept thin.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from ..face import template
from .texels import MIN_LINEAR, Texels, measure_border_distance
from .unet import Trunk

CHANNELS = 23
MAX_LOG = 2.5
"""Natural log units beyond which a colour has nothing to do with the skin under the fitted light."""

BAND_TEXELS = (1, 8, 40)
"""Texels of a map of 512 over which an error is alike: of each band the network says how large it is."""
MIN_LIGHT_SHARE = 0.03
"""Share of the brightest light below which a fit says nothing."""
FINE, FINEST = 24, 12
"""Features at half the map's size, and at its own."""


@dataclass(frozen=True)
class UnfoldedMaps:
    """What Texels says of N heads, on one device: float32 [N, channels, S, S]."""

    log: torch.Tensor
    spread: torch.Tensor
    seen: torch.Tensor
    normal: torch.Tensor
    open: torch.Tensor
    ambient: torch.Tensor
    direct: torch.Tensor
    free: torch.Tensor


def to_tensors(texels: Texels, device: str | torch.device) -> UnfoldedMaps:
    """One head's texels."""
    def tensor(values: np.ndarray) -> torch.Tensor:
        planes = np.atleast_3d(values).transpose(2, 0, 1)[None]
        return torch.from_numpy(np.ascontiguousarray(planes, np.float32)).to(device)

    return UnfoldedMaps(*(tensor(getattr(texels, field.name)) for field in fields(UnfoldedMaps)))


def network_input(maps: UnfoldedMaps) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """[N, CHANNELS, S, S] and light [N, 6, S, S] for TexelNet, and the mean log colour [N, 3, 1, 1] of the face that
    was seen, by which the log-shading that comes out is lower. light: what the fitted sky gives and the fitted sun
    would add, each channel over the mean of both on the face."""
    side, device = maps.log.shape[-1], maps.log.device
    place, face = _place(side, device)
    seen = maps.seen.clamp(0, 1)
    known, there = (seen / 0.2).clamp_max(1) * face + 1e-9, (seen > 0).float()

    def on_face(values: torch.Tensor) -> torch.Tensor:
        return (values * known).sum((2, 3), keepdim=True) / known.sum((2, 3), keepdim=True)

    middle = on_face(maps.log)
    sun = maps.direct.amax(1, keepdim=True) * maps.free
    lit = sun / (maps.ambient.amax(1, keepdim=True) + sun).clamp_min(1e-6)
    border = np.stack([measure_border_distance(each) for each in (lit[:, 0] > 1e-3).cpu().numpy()])
    fitted = (maps.ambient, maps.ambient + maps.direct * maps.free)
    against = [(maps.log - light.clamp_min(MIN_LINEAR / 4).log()).clamp(-MAX_LOG, MAX_LOG) * there for light in fitted]
    layers = [(maps.log - middle) * there, maps.spread, seen, maps.normal, maps.open, *against, lit,
              torch.from_numpy(border)[:, None].to(device), place.expand(len(seen), -1, -1, -1)]
    whole = on_face(maps.ambient + maps.direct).clamp_min(1e-6)
    return torch.cat(layers, 1), torch.cat([maps.ambient / whole, maps.direct / whole], 1), middle


@cache
def _place(side: int, device: torch.device) -> tuple[torch.Tensor, torch.Tensor]:
    """Where on the face a texel lies [1, 6, S, S]: masks of brows, lips, eyes and nostrils, and u (from the middle,
    alike on both sides) and v in [-1, 1]; and the mask of the face [S, S]."""
    v, u = (np.mgrid[0:side, 0:side] + 0.5) * 2 / side - 1
    masks = [template.mask(name, side) for name in ("brows", "lips", "eyes", "nostrils")]
    layers = np.stack([*masks, np.abs(u), v]).astype(np.float32)
    return tuple(torch.from_numpy(array.astype(np.float32)).to(device)
                 for array in (layers[None], template.mask("face", side)))


class TexelNet(Trunk):
    """[N, CHANNELS, S, S] and the fitted light [N, 6, S, S] (network_input) -> log-shading less the face's mean
    log colour [N, 3, S, S], logits of shadow [N, 1, S, S], and the log of the expected error [N, 3, S / 4, S / 4], one
    for each of BAND_TEXELS, in natural log units. S is a multiple of 32 that the widths can halve."""

    def __init__(self, widths: list[int], depths: list[int]):
        super().__init__(widths, depths)
        self.begin = nn.Conv2d(CHANNELS, FINEST, 3, padding=1)
        self.stem, self.enter = nn.Conv2d(CHANNELS, FINE, 4, stride=2,
                                          padding=1), nn.Conv2d(FINE, widths[0], 2, stride=2)
        self.level, self.spread = nn.Conv2d(widths[0], 3, 1), nn.Conv2d(widths[0], len(BAND_TEXELS), 1)
        self.leave, self.last = nn.Conv2d(widths[0], 4 * FINE, 1), nn.Conv2d(2 * FINE, 4 * FINEST, 3, padding=1)
        self.finish, self.out = nn.Conv2d(2 * FINEST, 2 * FINEST, 3, padding=1), nn.Conv2d(2 * FINEST, 1, 3, padding=1)
        for layer, bias in ((self.level, 0.0), (self.out, 0.0), (self.spread, -2.0)):
            nn.init.zeros_(layer.weight)
            nn.init.constant_(layer.bias, bias)

    def forward(self, x: torch.Tensor, light: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        finest, fine = functional.gelu(self.begin(x)), functional.gelu(self.stem(x))
        x = self.transform(self.enter(fine))
        spread = self.spread(x).float().clamp(-7, 1)
        level = functional.interpolate(self.level(x).float(), scale_factor=4, mode="bilinear", align_corners=False)
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        x = torch.cat([finest, functional.pixel_shuffle(functional.gelu(self.last(x)), 2)], 1)
        blocked = self.out(functional.gelu(self.finish(x))).float()
        lit = light[:, :3] + torch.sigmoid(-blocked) * light[:, 3:]
        return torch.log(lit.clamp_min(MIN_LIGHT_SHARE)) + level, blocked, spread
