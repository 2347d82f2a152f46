# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""M laid on the shadow's edges before the first step: a sharp edge of the shadow can live in M alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch

from ...light.shadow_edges import place
from ..evidence import Evidence


def snap_to_edges(
    evidence: Evidence, light: torch.Tensor, weight: torch.Tensor, check: Callable[[], None] = lambda: None
) -> Evidence:
    """Return the evidence with M on the edges of a linear light [3, S, S]; what is protected stays out of M.

    weight [S, S] is how much a texel reveals of the light; `check` may raise to cancel.
    """
    weight = (weight * evidence.covered).numpy()
    edge = place(light.permute(1, 2, 0).numpy(), evidence.alpha.numpy(), weight, evidence.texel, check)
    alpha = torch.from_numpy(edge.alpha) * (1 - evidence.protected) * evidence.covered
    colour = tuple(edge.colour.tolist())
    return replace(evidence, alpha=alpha, edge=torch.from_numpy(edge.on_edge), shadow_colour=colour)
