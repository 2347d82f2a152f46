# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighting network: a small U-Net from a picture of a face to a bilateral grid of its log-shading and shadows.

The grid has half the picture's resolution, and bins over the luminance about its local mean: `slice_grid` reads the
answer at the pixels of a picture of any size, so that what is darker than its surroundings may lie in a shadow, and the
shadow's edge is the picture's own (Chen, Paris and Durand, Real-time Edge-Aware Image Processing with the Bilateral
Grid, 2007; Gharbi et al., Deep Bilateral Learning for Real-Time Image Enhancement, 2017). Training and use share
`network_input`. All logarithms are natural and of linear light.
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
BIN_LOG = 0.6  # natural log of luminance between two bins of the grid
AROUND_CELLS = 1.5  # deviation of the Gaussian whose mean the guide is counted from, in cells of the grid
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


def slice_grid(grid: torch.Tensor, log: torch.Tensor) -> torch.Tensor:
    """Read a grid [N, C, D, h, w] at the pixels of a picture's log [N, 3, H, W], trilinearly: [N, C, H, W]."""
    bins, size = grid.shape[2], log.shape[2:]
    at = _guide(log, grid.shape[3:]) / BIN_LOG + (bins - 1) / 2
    at = at.clamp(0, bins - 1)
    out = 0
    for k in range(bins):
        share = (1 - (at - k).abs()).clamp_min(0)
        out = out + share * functional.interpolate(grid[:, :, k], size=size, mode="bilinear", align_corners=False)
    return out


def _guide(log: torch.Tensor, cells: tuple[int, int]) -> torch.Tensor:
    """Return the log-luminance of a picture [N, 3, H, W] less its mean over some cells around, [N, 1, H, W]."""
    luminance = log.mean(1, keepdim=True)
    coarse = functional.interpolate(luminance, size=cells, mode="area")
    reach = round(3 * AROUND_CELLS)
    kernel = torch.exp(-0.5 * (torch.arange(-reach, reach + 1, device=log.device) / AROUND_CELLS) ** 2)
    kernel = (kernel / kernel.sum()).to(log.dtype)
    padded = functional.pad(coarse, (reach,) * 4, mode="replicate")
    mean = functional.conv2d(functional.conv2d(padded, kernel.view(1, 1, -1, 1)), kernel.view(1, 1, 1, -1))
    return luminance - functional.interpolate(mean, size=log.shape[2:], mode="bilinear", align_corners=False)


class DelightNet(Ladder):
    """Network from [N, CHANNELS, S, S] to a grid [N, answers, bins, S/2, S/2].

    It holds log-shading less the picture's middle, shadow logits and, if there are five answers, the logarithm of the
    size within which two in three errors of the log-shading's luminance lie. S is a multiple of 32. The coarsest level
    attends to all of itself.
    """

    def __init__(self, widths: list[int], depths: list[int], bins: int = 1, answers: int = 4):
        super().__init__()
        self.add_levels(widths, depths)
        self.bins, self.answers = bins, answers
        self.attention = Attention(widths[-1])
        self.stem, self.enter = (
            nn.Conv2d(CHANNELS, FINE, 4, stride=2, padding=1),
            nn.Conv2d(FINE, widths[0], 2, stride=2),
        )
        self.leave = nn.Conv2d(widths[0], 4 * FINE, 1)  # the finest level, where pictures are large, is kept thin
        self.last, self.out = (
            nn.Conv2d(2 * FINE, 2 * FINE, 3, padding=1),
            nn.Conv2d(2 * FINE, answers * bins, 3, padding=1),
        )
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def look_at_all(self, x: torch.Tensor) -> torch.Tensor:
        return self.attention(x)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        fine = functional.gelu(self.stem(x))
        x = self.transform(self.enter(fine))
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        return self.out(functional.gelu(self.last(x))).float().unflatten(1, (self.answers, self.bins))


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
