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
                 part: tuple[slice, slice] = WHOLE_MAP) -> torch.Tensor:
    """The map [1, 7, S, S], or those rows and columns of it, with the normals and specular that are expected of its
    albedo where the recipe's guidance was the closed form; as it is where not. coords [1, 2, S, S] are the whole map's;
    a part gets the noise that it would get in the whole map."""
    if recipe.guidance != "proximal":
        return denoised
    noise = torch.randn(1, denoised.shape[1], *coords.shape[-2:],
                        generator=torch.Generator().manual_seed(seed)).to(denoised.device)
    return prior.respond(denoised, coords[(..., *part)], noise[(..., *part)])
