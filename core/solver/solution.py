# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a solve found, for a later one of a part to go on from."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from .lighting import Lights


@dataclass(frozen=True)
class Solution:
    """What a solve ended with, all of the whole map: denoised x_0 [1, 7, S, S] before the maps' own gain, lights, the
    mask as `painted` [S, S] and as it was used (`alpha`), the skin's tone, linear [3], gain [3] of the albedo, exposure
    of the texture; local [3, C, C]: initial.Start's; settled: whether the split told the global light."""

    denoised: torch.Tensor
    lights: Lights
    painted: torch.Tensor
    alpha: torch.Tensor
    tone: torch.Tensor
    gain: torch.Tensor
    exposure: float
    local: torch.Tensor
    settled: bool
