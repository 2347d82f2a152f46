# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""M laid on the shadow's edges before the first step (core/light/shadow_edges.py says how): a sharp edge of the shadow
can live in M alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch

from ...light.shadow_edges import place
from ..evidence import Evidence


def snap_to_edges(
    evidence: Evidence, light: torch.Tensor, weight: torch.Tensor, check: Callable[[], None] = lambda: None
) -> Evidence:
    """The evidence with `place`'s alpha for its own. What is protected stays out of M.

    Parameters
    ----------
    evidence : of the capture
    light : [3, S, S], linear, as `place` takes it but for the order of its axes
    weight : [S, S] in [0, 1], how far a texel tells of light
    check : may raise to cancel
    """
    edge = place(
        light.permute(1, 2, 0).numpy(),
        evidence.alpha.numpy(),
        (weight * evidence.covered).numpy(),
        evidence.texel,
        check,
    )
    alpha = torch.from_numpy(edge.alpha) * (1 - evidence.protected) * evidence.covered
    return replace(
        evidence, alpha=alpha, edge=torch.from_numpy(edge.on_edge), shadow_colour=tuple(edge.colour.tolist())
    )
