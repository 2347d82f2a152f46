# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the closed form leaves out. It moves the albedo alone, so normals and specular hear of the texture only through
what the prior makes of it later, and end as far from the truth as another person's. One evaluation of the prior gives
those that are expected of the albedo."""

from __future__ import annotations

import torch

from .prior import ConditionedPrior
from .recipes import Recipe

WHOLE_MAP = slice(None), slice(None)


def restore_maps(prior: ConditionedPrior, denoised: torch.Tensor, coords: torch.Tensor, recipe: Recipe, seed: int,
                 region: tuple[slice, slice] = WHOLE_MAP) -> torch.Tensor:
    """The map with the normals and specular that are expected of its albedo, where the recipe's guidance was the closed
    form; as it is where not.

    Parameters
    ----------
    prior : of the skin tone
    denoised : [1, 7, S, S] in the network's range, or only the rows and columns `region` of it
    coords : [1, 2, S, S] in [-1, 1], of the whole map
    recipe : of the solve
    seed : of the noise
    region : rows and columns; they get the noise that they would get in the whole map

    Returns
    -------
    As `denoised`.
    """
    if recipe.guidance != "proximal":
        return denoised
    noise = torch.randn(1, denoised.shape[1], *coords.shape[-2:],
                        generator=torch.Generator().manual_seed(seed)).to(denoised.device)
    return prior.respond(denoised, coords[(..., *region)], noise[(..., *region)])
