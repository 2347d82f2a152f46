# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The parsing network: a small U-Net from the crop of a face to the parts' logits at the crop's resolution.

Its trunk begins at a quarter of the resolution; beside it runs one thin layer at half, from which the finest pixels are
shuffled.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file
from torch import nn
from torch.nn import functional

from ..contract import shipped_files
from ..contract.messages import Problem
from .parts import PARTS

CHANNELS = 4  # sRGB in [-1, 1], 0 beyond the picture, and where the picture is
FINE = 16  # features at half the crop's resolution


def network_input(srgb: np.ndarray, known: np.ndarray) -> np.ndarray:
    """[CHANNELS, S, S] of a crop sRGB [S, S, 3] and of where it shows the picture [S, S].

    Stretched to the contrast that most pictures have, so that dark ones are not another world.
    """
    there = known > 0.5
    level = srgb.mean(-1)[there]
    bright = float(np.quantile(level, 0.9)) if level.size else 1.0
    gain = np.clip(0.75 / max(bright, 1e-3), 0.8, 6.0)
    layers = np.zeros((CHANNELS, *known.shape), np.float32)
    layers[:3] = ((2 * np.clip(srgb * gain, 0, 1) - 1) * there[..., None]).transpose(2, 0, 1)
    layers[3] = there
    return layers


def read_network(path: Path, reader: str, parts: int) -> ParseNet:
    """The network of a file of weights and the card beside it, ready to be asked; reader: whose they are, in words.
    Raises Problem where one of them is missing, or a shipped file damaged."""
    card = path.with_suffix(".json")
    if not (path.is_file() and card.is_file()):
        raise Problem(f"The weights of the {reader} are missing.", "Install the extension again.")
    shipped_files.require_whole(path)
    network = ParseNet(**json.loads(card.read_text(encoding="utf-8"))["model"], parts=parts)
    network.load_state_dict({name: value.float() for name, value in load_file(path).items()})
    return network.eval()


class ParseNet(nn.Module):
    """[N, CHANNELS, S, S] -> logits [N, parts, S, S]. S is a multiple of 32, to be halved so often."""

    def __init__(self, widths: list[int], depths: list[int], parts: int = len(PARTS)):
        super().__init__()
        self.stem = nn.Conv2d(CHANNELS, FINE, 4, stride=2, padding=1)
        self.enter = nn.Conv2d(FINE, widths[0], 2, stride=2)
        self.down, self.up, self.halve, self.narrow = nn.ModuleList(), nn.ModuleList(), nn.ModuleList(), nn.ModuleList()
        for level, (width, depth) in enumerate(zip(widths, depths, strict=True)):
            self.down.append(nn.Sequential(*(_Block(width) for _ in range(depth))))
            if level + 1 < len(widths):
                self.halve.append(nn.Conv2d(width, widths[level + 1], 2, stride=2))
                self.narrow.append(nn.Conv2d(widths[level + 1], width, 1))
                self.up.append(nn.Sequential(*(_Block(width) for _ in range(depth))))
        self.leave = nn.Conv2d(widths[0], 4 * FINE, 1)
        self.last = nn.Conv2d(2 * FINE, 2 * FINE, 3, padding=1)
        self.out = nn.Conv2d(2 * FINE, 4 * parts, 3, padding=1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        fine = functional.gelu(self.stem(x))
        x, kept = self.enter(fine), []
        for level, blocks in enumerate(self.down):
            x = blocks(x)
            if level < len(self.halve):
                kept.append(x)
                x = self.halve[level](x)
        for level in reversed(range(len(self.halve))):
            x = functional.interpolate(self.narrow[level](x), scale_factor=2, mode="bilinear", align_corners=False)
            x = kept[level] + x
            x = self.up[level](x)
        x = torch.cat([fine, functional.pixel_shuffle(self.leave(x), 2)], 1)
        return functional.pixel_shuffle(self.out(functional.gelu(self.last(x))), 2).float()


class _Block(nn.Module):
    """x + conv(gelu(conv(norm(x)))), and a gate per channel from the whole map's mean: light and exposure are matters
    of the whole picture."""

    def __init__(self, width: int):
        super().__init__()
        self.norm = nn.GroupNorm(max(1, width // 16), width)
        self.first, self.second = nn.Conv2d(width, width, 3, padding=1), nn.Conv2d(width, width, 3, padding=1)
        self.gate = nn.Linear(width, width)
        nn.init.zeros_(self.second.weight)
        nn.init.zeros_(self.second.bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        inner = functional.gelu(self.first(self.norm(x)))
        inner = inner * (2 * torch.sigmoid(self.gate(inner.mean((2, 3)))))[:, :, None, None]
        return x + self.second(inner)
