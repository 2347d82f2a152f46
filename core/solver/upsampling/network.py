# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Super-resolution network U (paper, supplement): RCAN, with seven channels in and out, four times as large.

Zhang et al. 2018, "Image Super-Resolution Using Very Deep Residual Channel Attention Networks". It adds to bicubic
resampling what that misses, so with a tail of zeros it is bicubic resampling. Channels: sRGB-coded diffuse albedo (3),
tangent-space normal xyz (3), specular level (1).
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import nn
from torch.nn import functional

FACTOR = 4  # of the sides
CHANNELS = 7  # albedo, normal, specular
# approximate mean and deviation of a channel, by which the input is centred and scaled
CHANNEL_MEANS = (0.5, 0.5, 0.5, 0.0, 0.0, 1.0, 0.35)
CHANNEL_DEVIATIONS = (0.2, 0.2, 0.2, 0.15, 0.15, 0.05, 0.15)
# approximate error of bicubic resampling in a channel: the unit of the network's output, and of its loss
BICUBIC_ERRORS = (0.012, 0.012, 0.012, 0.05, 0.05, 0.015, 0.012)
# texels of the small map that the tail reads around a strip: 1 + 1/2 + 1/4 by three 3 x 3 convolutions on ever finer
# grids, two by the bicubic kernel
HALO_TEXELS = 2


class ChannelAttention(nn.Module):
    """Scales of the channels, predicted from their means over the map."""

    def __init__(self, width: int, squeeze: int):
        super().__init__()
        self.inner, self.outer = nn.Conv2d(width, width // squeeze, 1), nn.Conv2d(width // squeeze, width, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        mean = x.mean((2, 3), keepdim=True, dtype=torch.float32).to(x.dtype)  # [N, C, 1, 1]
        return x * torch.sigmoid(self.outer(functional.relu(self.inner(mean))))


class ChannelAttentionBlock(nn.Module):
    """Residual channel-attention block; begins as the identity, so that a network can grow while it learns."""

    def __init__(self, width: int, squeeze: int):
        super().__init__()
        self.first, self.second = (nn.Conv2d(width, width, 3, padding=1) for _ in range(2))
        self.attention = ChannelAttention(width, squeeze)
        nn.init.zeros_(self.second.weight)
        nn.init.zeros_(self.second.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x + self.attention(self.second(functional.relu(self.first(x))))


class Rcan(nn.Module):
    """RCAN of `groups` residual groups of `blocks` blocks of `width` features; the original has 10 of 20."""

    def __init__(self, groups: int, blocks: int, width: int, squeeze: int = 16):
        super().__init__()
        self.head = nn.Conv2d(CHANNELS, width, 3, padding=1)
        self.groups = nn.ModuleList(
            nn.ModuleList(ChannelAttentionBlock(width, squeeze) for _ in range(blocks)) for _ in range(groups)
        )
        self.joins = nn.ModuleList(nn.Conv2d(width, width, 3, padding=1) for _ in range(groups))
        self.join = nn.Conv2d(width, width, 3, padding=1)
        self.widen = nn.ModuleList(nn.Conv2d(width, 4 * width, 3, padding=1) for _ in range(2))
        self.tail = nn.Conv2d(width, CHANNELS, 3, padding=1)
        for layer in (*self.joins, self.join, self.tail):
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.tail.weight)

    def forward(self, maps: torch.Tensor, depth: int | None = None) -> torch.Tensor:
        """Return what bicubic resampling misses of maps [N, 7, H, W], by `depth` blocks a group: [N, 7, 4H, 4W]."""
        return self.details(self.features(maps, depth))

    def features(
        self, maps: torch.Tensor, depth: int | None = None, tick: Callable[[float], None] = lambda share: None
    ) -> torch.Tensor:
        """Run the body, [N, 7, H, W] -> [N, width, H, W], on a whole map for its attention; `tick` gets the share."""
        begun = self.head((maps - _channels(CHANNEL_MEANS, maps)) / _channels(CHANNEL_DEVIATIONS, maps))
        x = begun
        for i, (group, join) in enumerate(zip(self.groups, self.joins, strict=True)):
            y = x
            for k, block in enumerate(group[:depth]):
                y = block(y)
                tick((i + (k + 1) / (len(group[:depth]) + 1)) / len(self.groups))
            x = x + join(y)
        tick(1.0)
        return begun + self.join(x)

    def details(self, features: torch.Tensor) -> torch.Tensor:
        """Run the tail, [N, width, H, W] -> [N, 7, 4H, 4W], on the whole or on strips with HALO_TEXELS around."""
        x = features
        for widen in self.widen:
            x = functional.pixel_shuffle(widen(x), 2)
        return self.tail(x) * _channels(BICUBIC_ERRORS, features)


def bicubic(maps: torch.Tensor) -> torch.Tensor:
    """Resample [N, 7, H, W] to [N, 7, 4H, 4W], the albedo in linear light."""
    linear = torch.cat([srgb_to_linear(maps[:, :3]), maps[:, 3:]], 1)
    large = functional.interpolate(linear, scale_factor=FACTOR, mode="bicubic", align_corners=False)
    return torch.cat([linear_to_srgb(large[:, :3].clamp(0, 1)), large[:, 3:]], 1)


def srgb_to_linear(x: torch.Tensor) -> torch.Tensor:
    return torch.where(x <= 0.04045, x / 12.92, ((x.clamp_min(0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(x: torch.Tensor) -> torch.Tensor:
    return torch.where(x <= 0.0031308, 12.92 * x, 1.055 * x.clamp_min(0.0031308) ** (1 / 2.4) - 0.055)


def _channels(per_channel: tuple[float, ...], like: torch.Tensor) -> torch.Tensor:
    return torch.tensor(per_channel, dtype=like.dtype, device=like.device)[:, None, None]
