# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighting network in the head's own UV space: from what all views saw of each texel to its log-shading, and how
sure that is.

The shading has the form of the light that was fitted to the skin: sky, and as much of the sun as nothing blocks. Which
share that is the network tells texel by texel, and what the fit gets wrong. A U-Net whose deepest map, 16 texels wide,
attends to all of itself: one half of a face tells the light on the other. Its finest level, where maps are large, is
kept thin.
"""

from __future__ import annotations

import torch
from torch import nn
from torch.nn import functional

from .texels import CHANNELS
from .unet import Trunk

BANDS = (1, 8, 40)
"""Texels of a map of 512 over which an error is alike: of each band the network says how large it is."""
DARKEST_LIGHT = 0.03
"""Share of the brightest light below which a fit says nothing."""
FINE, FINEST = 24, 12
"""Features at half the map's size, and at its own."""


class TexelNet(Trunk):
    """[N, CHANNELS, S, S] and the fitted light [N, 6, S, S] (texels.network_input) -> log-shading less the face's mean
    log colour [N, 3, S, S], logits of shadow [N, 1, S, S], and the log of the expected error [N, 3, S / 4, S / 4], one
    for each of BANDS, in natural log units. S is a multiple of 32 that the widths can halve."""

    def __init__(self, widths: list[int], depths: list[int]):
        super().__init__(widths, depths)
        self.begin = nn.Conv2d(CHANNELS, FINEST, 3, padding=1)
        self.stem, self.enter = nn.Conv2d(CHANNELS, FINE, 4, stride=2,
                                          padding=1), nn.Conv2d(FINE, widths[0], 2, stride=2)
        self.spread = nn.Conv2d(widths[0], len(BANDS), 1)
        self.leave, self.last = nn.Conv2d(widths[0], 4 * FINE, 1), nn.Conv2d(2 * FINE, 4 * FINEST, 3, padding=1)
        self.finish, self.out = nn.Conv2d(2 * FINEST, 2 * FINEST, 3, padding=1), nn.Conv2d(2 * FINEST, 4, 3, padding=1)
        for layer, bias in ((self.out, 0.0), (self.spread, -2.0)):
            nn.init.zeros_(layer.weight)
            nn.init.constant_(layer.bias, bias)

    def forward(self, x: torch.Tensor, light: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        finest, fine = functional.gelu(self.begin(x)), functional.gelu(self.stem(x))
        x = self.transform(self.enter(fine))
        spread = self.spread(x).float().clamp(-7, 1)
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        x = torch.cat([finest, functional.pixel_shuffle(functional.gelu(self.last(x)), 2)], 1)
        out = self.out(functional.gelu(self.finish(x))).float()
        blocked = out[:, 3:]
        lit = light[:, :3] + torch.sigmoid(-blocked) * light[:, 3:]
        return torch.log(lit.clamp_min(DARKEST_LIGHT)) + out[:, :3], blocked, spread
