# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A network's weights in a byte each: a filter's largest weight is 127, and its scale is kept beside it. Of a large
network that is half of what 16 bits take."""

from __future__ import annotations

import torch

SCALE_SUFFIX = ".scale"
MIN_PACKED_WEIGHTS = 256
"""Weights of a tensor below which packing saves nothing."""


def pack(weights: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Tensors with several filters as int8 with float16 scales [filters], the others as float16."""
    packed = {}
    for name, value in weights.items():
        if value.ndim < 2 or value.numel() < MIN_PACKED_WEIGHTS:
            packed[name] = value.half().contiguous()
            continue
        rows = value.float().flatten(1)
        scale = (rows.abs().amax(1) / 127).clamp_min(1e-6).half()
        packed[name] = (rows / scale.float()[:, None]).round().clamp(-127, 127).to(torch.int8).reshape(value.shape)
        packed[name + SCALE_SUFFIX] = scale
    return packed


def unpack(packed: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """The float32 weights of packed ones; unpacked ones as they are."""
    return {name: value.float() * packed[name + SCALE_SUFFIX].float().reshape(-1, *(1,) * (value.ndim - 1))
            if name + SCALE_SUFFIX in packed else value.float()
            for name, value in packed.items() if not name.endswith(SCALE_SUFFIX)}
