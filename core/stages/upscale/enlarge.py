# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Enlarge the maps by the network, exactly, in little memory.

The body runs on the whole map, because its attention looks at all of it, the tail in strips with what they read around
them: without strips the tail's features at 4096 alone would be 4 GB.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import torch

from ...capture.messages import Problem
from ...face.networks import has_files, read_network
from ...imaging import images
from ...solver.upsampling.network import CHANNELS, FACTOR, HALO_TEXELS, Rcan, bicubic
from .maps import HeadMaps

DATA_FILES = ("weights/upscaler.safetensors", "weights/upscaler.json")
WEIGHTS = Path(__file__).resolve().parents[2] / DATA_FILES[0]
STRIP_ROWS = 64  # of the small map whose tail is computed at once


@torch.no_grad()
def enlarge(
    maps: HeadMaps, progress: Callable[[float], None], device: str = "cpu", network: Rcan | None = None
) -> np.ndarray:
    """Return the maps four times as large: diffuse (sRGB), unit normal and specular, float32 [4S, 4S, 7].

    `progress` gets the share done; `network` takes the place of the shipped one.
    """
    network = network or load_network()
    network = network.to(device, memory_format=torch.channels_last)
    small = channels_of(maps).to(device, memory_format=torch.channels_last)
    height, width = small.shape[2:]
    large = np.empty((FACTOR * height, FACTOR * width, CHANNELS), np.float32)
    with torch.autocast(device, torch.bfloat16, enabled=device == "cuda" or torch.cpu._is_avx512_bf16_supported()):
        features = network.features(small, tick=lambda share: progress(0.75 * share))
        for row in range(0, height, STRIP_ROWS):
            rows = slice(row, min(row + STRIP_ROWS, height))
            strip = _strip(network, small, features, rows).permute(1, 2, 0).cpu().numpy()
            large[FACTOR * rows.start : FACTOR * rows.stop] = strip
            progress(0.75 + 0.25 * rows.stop / height)
    return large


def channels_of(maps: HeadMaps) -> torch.Tensor:
    """Return the network's input [1, 7, S, S]."""
    srgb = images.linear_to_srgb(np.clip(maps.diffuse, 0, 1))
    stacked = np.concatenate([srgb, maps.normal, maps.specular[..., None]], -1)
    return torch.from_numpy(np.ascontiguousarray(stacked.transpose(2, 0, 1), np.float32))[None]


@cache
def load_network(path: Path = WEIGHTS) -> Rcan:
    """Load the shipped network. Raises Problem if its files are missing."""
    if not has_files(path):
        raise Problem(
            f"The upscaler's weights are missing ({path.name}).",
            "Install the extension again, or choose Lanczos as the way to enlarge.",
        )
    return read_network(Rcan, path)


def _strip(network: Rcan, small: torch.Tensor, features: torch.Tensor, rows: slice) -> torch.Tensor:
    """Return rows of the result, [7, 4R, 4W]."""
    first, end = max(rows.start - HALO_TEXELS, 0), min(rows.stop + HALO_TEXELS, small.shape[2])
    inner = slice(FACTOR * (rows.start - first), FACTOR * (rows.stop - first))
    details = network.details(features[:, :, first:end])[:, :, inner].float()
    strip = (bicubic(small[:, :, first:end])[:, :, inner] + details)[0]
    strip[3:6] /= strip[3:6].norm(dim=0).clamp_min(1e-6)
    for bounded in (slice(0, 3), slice(6, 7)):
        strip[bounded].clamp_(0, 1)
    return strip
