# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Expected normals and specular at the end of the walk.

The texture constrains the albedo alone: theirs are a draw, as far from the truth as another person's, or farther still
under proximal guidance. One evaluation of the prior gives their expectation under the albedo, which no draw beats.
"""

from __future__ import annotations

import torch

from ..prior.prior import ConditionedPrior


def restore_maps(
    prior: ConditionedPrior,
    denoised: torch.Tensor,
    coords: torch.Tensor,
    seed: int,
    region: tuple[slice, slice] = (slice(None), slice(None)),
) -> torch.Tensor:
    """Return the map [1, 7, S, S] with the normals and specular that are expected of its albedo.

    It may be the rows and columns `region` of the map alone, which get the noise they would get in the whole map.
    coords [1, 2, S, S] are the whole map's.
    """
    shape, generator = (1, denoised.shape[1], *coords.shape[-2:]), torch.Generator().manual_seed(seed)
    noise = torch.randn(shape, generator=generator).to(denoised.device)
    return prior.respond(denoised, coords[(..., *region)], noise[(..., *region)])
