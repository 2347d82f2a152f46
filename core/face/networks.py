# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Common parts of the networks that look at pictures of faces: the levels of a U-Net, and reading shipped weights."""

import json
from pathlib import Path

import torch
from safetensors.torch import load_file
from torch import nn
from torch.nn import functional

from ..capture import shipped_files


def has_files(weights: Path) -> bool:
    """Return True if a file of weights and the card beside it exist."""
    return weights.is_file() and weights.with_suffix(".json").is_file()


def read_network(kind: type[nn.Module], weights: Path, **options) -> nn.Module:
    """Build a network of that class, in evaluation mode, from its weights and the card beside them.

    Raises Problem where a shipped file is damaged.
    """
    shipped_files.require_whole(weights)
    network = kind(**json.loads(weights.with_suffix(".json").read_text(encoding="utf-8"))["model"], **options)
    network.load_state_dict({name: value.float() for name, value in load_file(weights).items()})
    return network.eval()


class Ladder(nn.Module):
    """U-Net over levels of some `widths`, each of `depths` blocks and half as fine as the one before."""

    def add_levels(self, widths: list[int], depths: list[int]) -> None:
        self.down, self.up, self.halve, self.narrow = nn.ModuleList(), nn.ModuleList(), nn.ModuleList(), nn.ModuleList()
        for level, (width, depth) in enumerate(zip(widths, depths, strict=True)):
            self.down.append(nn.Sequential(*(Block(width) for _ in range(depth))))
            if level + 1 < len(widths):
                self.halve.append(nn.Conv2d(width, widths[level + 1], 2, stride=2))
                self.narrow.append(nn.Conv2d(widths[level + 1], width, 1))
                self.up.append(nn.Sequential(*(Block(width) for _ in range(depth))))

    def transform(self, x: torch.Tensor) -> torch.Tensor:
        """Run [N, widths[0], H, W] down to the coarsest level and back."""
        skips = []
        for level, blocks in enumerate(self.down):
            x = blocks(x)
            if level < len(self.halve):
                skips.append(x)
                x = self.halve[level](x)
        x = self.look_at_all(x)
        for level in reversed(range(len(self.halve))):
            x = skips[level] + functional.interpolate(
                self.narrow[level](x), scale_factor=2, mode="bilinear", align_corners=False
            )
            x = self.up[level](x)
        return x

    def look_at_all(self, x: torch.Tensor) -> torch.Tensor:
        """Process the coarsest level beside its blocks."""
        return x


class Block(nn.Module):
    """Residual block with a gate per channel from the mean of the whole map.

    x + conv(gelu(conv(norm(x)))); exposure and light concern the whole picture.
    """

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
