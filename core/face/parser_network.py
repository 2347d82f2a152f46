# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parsing network: a small U-Net from the crop of a face to the parts' logits at the crop's resolution.

Its trunk begins at a quarter of the resolution; beside it runs one thin layer at half, from which the finest pixels are
shuffled.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from ..capture.messages import Problem
from . import networks
from .parts import PARTS

CHANNELS = 4  # sRGB in [-1, 1], 0 beyond the picture, and where the picture is
FINE = 16  # features at half the crop's resolution


def network_input(srgb: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Stack [CHANNELS, S, S] from a crop sRGB [S, S, 3] and the share of it that shows the picture [S, S].

    It is stretched to the contrast of most pictures, so that dark ones look alike.
    """
    in_picture = inside > 0.5
    level = srgb.mean(-1)[in_picture]
    bright = float(np.quantile(level, 0.9)) if level.size else 1.0
    gain = np.clip(0.75 / max(bright, 1e-3), 0.8, 6.0)
    layers = np.zeros((CHANNELS, *inside.shape), np.float32)
    layers[:3] = ((2 * np.clip(srgb * gain, 0, 1) - 1) * in_picture[..., None]).transpose(2, 0, 1)
    layers[3] = in_picture
    return layers


def read_network(path: Path, reader: str, parts: int) -> ParseNet:
    """Read the network of a file of weights and the card beside it; `reader` names it to the user.

    Raises Problem where one of them is missing, or a shipped file damaged.
    """
    if not networks.has_files(path):
        raise Problem(f"The weights of the {reader} are missing.", "Install the extension again.")
    return networks.read_network(ParseNet, path, parts=parts)


class ParseNet(networks.Ladder):
    """Network from [N, CHANNELS, S, S] to logits [N, parts, S, S]; S is a multiple of 32."""

    def __init__(self, widths: list[int], depths: list[int], parts: int = len(PARTS)):
        super().__init__()
        self.stem = nn.Conv2d(CHANNELS, FINE, 4, stride=2, padding=1)
        self.enter = nn.Conv2d(FINE, widths[0], 2, stride=2)
        self.add_levels(widths, depths)
        self.leave = nn.Conv2d(widths[0], 4 * FINE, 1)
        self.last = nn.Conv2d(2 * FINE, 2 * FINE, 3, padding=1)
        self.out = nn.Conv2d(2 * FINE, 4 * parts, 3, padding=1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        fine = functional.gelu(self.stem(x))
        x = self.transform(self.enter(fine))
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        return functional.pixel_shuffle(self.out(functional.gelu(self.last(x))), 2).float()
