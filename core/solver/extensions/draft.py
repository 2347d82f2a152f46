# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals and specular at the end of the walk. The texture tells of the albedo alone: theirs are a draw, as far from
the truth as another person's, or with the closed form farther still. One evaluation of the prior gives those that are
expected of the albedo, which no draw comes nearer to the truth than."""

from __future__ import annotations

import torch

from ..prior.prior import ConditionedPrior

WHOLE_MAP = slice(None), slice(None)


def restore_maps(
    prior: ConditionedPrior,
    denoised: torch.Tensor,
    coords: torch.Tensor,
    seed: int,
    region: tuple[slice, slice] = WHOLE_MAP,
) -> torch.Tensor:
    """The map with the normals and specular that are expected of its albedo.

    Parameters
    ----------
    prior : of the skin tone
    denoised : [1, 7, S, S] in the network's range, or only the rows and columns `region` of it
    coords : [1, 2, S, S] in [-1, 1], of the whole map
    seed : of the noise
    region : rows and columns; they get the noise that they would get in the whole map

    Returns
    -------
    As `denoised`.
    """
    noise = torch.randn(1, denoised.shape[1], *coords.shape[-2:], generator=torch.Generator().manual_seed(seed)).to(
        denoised.device
    )
    return prior.respond(denoised, coords[(..., *region)], noise[(..., *region)])
