# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Result of a solve, from which a later one of a part goes on."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from .lighting import Lights


@dataclass(frozen=True)
class Solution:
    """End of a solve of the whole map.

    denoised: x_0 [1, 7, S, S] before the maps' own gain; painted, alpha [S, S]: the mask as it was painted and as it
    was used; tone: of the skin, linear [3]; gain [3] of the albedo; exposure [3] of the texture; local [3, C, C]: as in
    start.Start; settled: true if the split found the global light.
    """

    denoised: torch.Tensor
    lights: Lights
    painted: torch.Tensor
    alpha: torch.Tensor
    tone: torch.Tensor
    gain: torch.Tensor
    exposure: torch.Tensor
    local: torch.Tensor
    settled: bool
