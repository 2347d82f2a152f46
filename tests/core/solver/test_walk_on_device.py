# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A step of the walk stays on its device: nothing is read back from it, sent there, or made elsewhere. The card of
these tests is PyTorch's device `meta`, which every machine has: its tensors have shapes and no values, so that it
refuses to be read, and a step does with them what it does on a card."""

from dataclasses import replace

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

from core.solver.prior.network import UNet, UNetLayout
from core.solver.prior.prior import ConditionedPrior, Prior, ReleasedPrior
from core.solver.recipes import RECIPES
from core.solver.sampler import Sampler
from tests.fixtures.small_problems import SIZE, observation, start

CARD = "meta"
UNLIKE_OURS = {
    "wildcap": {},
    "proximal": {"guidance": "proximal"},
    "refitted": {"refit": 1.0},
    "paper": {},
    "released": {"candidates": 2},
}


class StaysOnCard(TorchDispatchMode):
    """Raises AssertionError for an operator whose tensors are not all on the card; a single number may come from the
    processor, as it goes along with the call."""

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        result = func(*args, **(kwargs or {}))
        tensors = [t for t in tree_leaves((args, kwargs, result)) if isinstance(t, torch.Tensor)]
        assert all(t.device.type == CARD or not t.dim() for t in tensors), func
        return result


def our_prior() -> ConditionedPrior:
    network = UNet(UNetLayout(7, 2 + 4 * 2, 16, [1, 1], [16, 16], mapping_cond_dim=5, norm="pixel"))
    prior = Prior(network, 2, torch.zeros(7, 8, 8), torch.ones(7)).to(CARD)
    return ConditionedPrior(prior, torch.ones(1, 3, device=CARD))


def released_prior() -> ConditionedPrior:
    network = UNet(UNetLayout(7, 2, 16, [1, 1], [16, 16], [False, True]))
    return ReleasedPrior(network, "coord", 0, None, None).to(CARD).of_tone()


@pytest.mark.parametrize("name", UNLIKE_OURS)
@pytest.mark.parametrize("make", [our_prior, released_prior])
def test_a_step_on_a_card_has_nothing_on_the_processor(name, make):
    recipe = RECIPES[name if name in RECIPES else "wildcap"]
    recipe = replace(recipe, steps=1, updates=2, **UNLIKE_OURS[name])
    mask = (torch.arange(SIZE) > SIZE // 2).float().expand(SIZE, SIZE)
    o = observation(torch.full((3, SIZE, SIZE), 0.3), mask)
    o = replace(o, restraint=mask, missing=0.1 * mask).to(CARD)
    state, prior = start().to(CARD), make()
    state.x = state.denoised
    prior(state.denoised, 1.0, o.coords)  # what the prior is told of a map is laid out once

    def draw(*shape):
        return torch.randn(shape, device=CARD)

    with StaysOnCard():
        Sampler(prior, recipe, None).step(o, state, (2.0, 1.0), recipe.steps, draw)
    tensors = (state.x, state.denoised, *state.lights.parameters(), *state.moments)
    assert state.step == 1 and state.moments and {tensor.device.type for tensor in tensors} == {CARD}
