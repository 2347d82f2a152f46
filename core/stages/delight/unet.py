# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighting network: a small U-Net from a picture of a face to its log-shading and shadows, at half the resolution.

Training and use share `network_input`. All logarithms are natural and of linear light.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from ...face.networks import Ladder
from ...imaging import images

SIDE_PX = 256  # of its picture
CHANNELS = 16  # of `network_input`
FINE = 24  # features at half the picture's resolution
MIN_LINEAR = 0.004  # linear; below is noise
FARTHEST_LOG = 2.5  # natural log: largest ratio between a picture and the fitted light


def network_input(
    srgb: np.ndarray,
    ambient: np.ndarray | None = None,
    sunlit: np.ndarray | None = None,
    normal: np.ndarray | None = None,
    head: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Return the network's input [CHANNELS, S, S] for a picture sRGB [S, S, 3], and the middle of its natural log.

    The latter is to be added to the log-shading that comes out. ambient, sunlit [S, S, 3]: linear colour of the head's
    skin under the fitted sky alone, and with the fitted sun; normal [S, S, 3]: unit, in camera coordinates; head [S, S]
    in [0, 1]: where these hold, also the last channel. Without them their channels are 0.
    """
    log = np.log(np.maximum(images.srgb_to_linear(srgb), MIN_LINEAR))
    side = len(log)
    inner = slice(side // 4, 3 * side // 4)
    middle = float(log[inner, inner].mean())
    layers = np.zeros((CHANNELS, side, side), np.float32)
    layers[0:3] = 2 * srgb.transpose(2, 0, 1) - 1
    layers[3:6] = (log - middle).transpose(2, 0, 1)
    if ambient is not None:
        for first, light in ((6, ambient), (9, sunlit)):
            ratio = np.clip(log - np.log(np.maximum(light, MIN_LINEAR / 4)), -FARTHEST_LOG, FARTHEST_LOG)
            layers[first : first + 3] = (ratio * head[..., None]).transpose(2, 0, 1)
        layers[12:15] = (normal * head[..., None]).transpose(2, 0, 1)
        layers[15] = head
    return layers, middle


class DelightNet(Ladder):
    """Network from [N, CHANNELS, S, S] to log-shading less the picture's middle, [N, 3, S/2, S/2], and shadow logits.

    These are [N, 1, S/2, S/2]; S is a multiple of 32. The coarsest level attends to all of itself.
    """

    def __init__(self, widths: list[int], depths: list[int]):
        super().__init__()
        self.add_levels(widths, depths)
        self.attention = Attention(widths[-1])
        self.stem, self.enter = (
            nn.Conv2d(CHANNELS, FINE, 4, stride=2, padding=1),
            nn.Conv2d(FINE, widths[0], 2, stride=2),
        )
        self.leave = nn.Conv2d(widths[0], 4 * FINE, 1)  # the finest level, where pictures are large, is kept thin
        self.last, self.out = nn.Conv2d(2 * FINE, 2 * FINE, 3, padding=1), nn.Conv2d(2 * FINE, 4, 3, padding=1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def look_at_all(self, x: torch.Tensor) -> torch.Tensor:
        return self.attention(x)

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        fine = functional.gelu(self.stem(x))
        x = self.transform(self.enter(fine))
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        out = self.out(functional.gelu(self.last(x))).float()
        return out[:, :3], out[:, 3:]


class Attention(nn.Module):
    """Self-attention over the coarsest map, where one side of a face informs the other."""

    def __init__(self, width: int, heads: int = 4):
        super().__init__()
        self.norm, self.heads = nn.LayerNorm(width), heads
        self.qkv, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        n, c, h, w = x.shape
        tokens = x.flatten(2).transpose(1, 2)  # [N, H W, C]
        q, k, v = self.qkv(self.norm(tokens)).reshape(n, h * w, 3, self.heads, c // self.heads).permute(2, 0, 3, 1, 4)
        mixed = functional.scaled_dot_product_attention(q, k, v).transpose(1, 2).reshape(n, h * w, c)
        return x + self.out(mixed).transpose(1, 2).reshape(n, c, h, w)
