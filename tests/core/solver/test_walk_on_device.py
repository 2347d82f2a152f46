# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A step of the walk stays on its device: nothing is read back from it, sent there, or made elsewhere. The card of
these tests is PyTorch's device `meta`, which every machine has: its tensors have shapes and no values, and a step does
with them what it does on a card."""

from dataclasses import replace

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

from core.solver.lighting import Lights, Shader, constant_light
from core.solver.objective import Observation, State
from core.solver.prior.network import UNet, UNetLayout
from core.solver.prior.prior import ConditionedPrior, Prior, ReleasedPrior, make_coordinates
from core.solver.recipes import RECIPES
from core.solver.sampler import Sampler, seed_noise

SIZE = 32
CARD = "meta"
READ = "_local_scalar_dense", "is_nonzero", "nonzero", "equal", "masked_select"
"""Operators of ATen that wait for the device: their result is a number on the processor, or its shape depends on what
was computed."""
UNLIKE_OURS = {
    "wildcap": {},
    "proximal": {"guidance": "proximal"},
    "refitted": {"refit": 1.0},
    "paper": {},
    "released": {"candidates": 2},
}


class StaysOn(TorchDispatchMode):
    """Raises AssertionError for an operator that reads a number back, or whose tensors are not all on the device; a
    single number may come from the processor, as it goes along with the call."""

    def __init__(self, device: str):
        super().__init__()
        self.device = device

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        assert func.overloadpacket.__name__ not in READ, f"{func} reads a number back from the device"
        result = func(*args, **(kwargs or {}))
        strange = [
            t
            for t in tree_leaves((args, kwargs, result))
            if isinstance(t, torch.Tensor) and t.device.type != self.device
        ]
        assert not any(t.dim() for t in strange), f"{func} with {[(t.device.type, tuple(t.shape)) for t in strange]}"
        return result


def observed(size: int) -> Observation:
    """A map half of which is in M, with normals that turn."""
    line = torch.linspace(-0.8, 0.8, size)
    y, x = torch.meshgrid(line, line, indexing="ij")
    normal = torch.nn.functional.normalize(torch.stack([x, -torch.ones_like(x), -y]), dim=0)
    alpha = (x > 0).float()
    ones = torch.ones(size, size)
    texture = torch.full((3, size, size), 0.3) * (1 - 0.5 * alpha)
    return Observation(
        texture,
        ones,
        ones,
        make_coordinates(size, slice(0, size), slice(0, size)),
        Shader(normal, alpha, (4, 4)),
        alpha > 2,
        4.0,
        ones,
        0.1 * ones,
    )


def begun(size: int, cells: tuple[int, int] = (4, 4)) -> State:
    lights = Lights(constant_light(torch.ones(3)), torch.zeros(1, 9, *cells), torch.ones(3))
    return State(0, torch.zeros(1, 7, size, size), torch.zeros(1, 7, size, size), lights)


def our_prior() -> ConditionedPrior:
    network = UNet(UNetLayout(7, 2 + 4 * 2, 16, [1, 1], [16, 16], mapping_cond_dim=5, norm="pixel"))
    return Prior(network, 2, torch.zeros(7, 8, 8), torch.ones(7)).of_tone(torch.tensor([0.4, 0.3, 0.2]))


def released_prior() -> ConditionedPrior:
    return ReleasedPrior(UNet(UNetLayout(7, 2, 16, [1, 1], [16, 16], [False, True])), "coord", 0, None, None).of_tone()


def walk(prior: ConditionedPrior, name: str, noise, device: str) -> State:
    """Two steps of a recipe, watched."""
    recipe = replace(
        RECIPES["wildcap" if name in ("proximal", "refitted") else name], steps=4, updates=8, **UNLIKE_OURS[name]
    )
    o, state = observed(SIZE).to(device), begun(SIZE).to(device)
    prior(state.denoised, 1.0, o.coords)  # what the prior is told of a map is laid out once
    for i in range(2):
        with StaysOn(device):
            Sampler(prior, recipe, noise).step(o, state, (2.0 - i, 1.0 - 0.5 * i), recipe.steps, noise(i))
    return state


@pytest.mark.parametrize("name", UNLIKE_OURS)
@pytest.mark.parametrize("make", [our_prior, released_prior])
def test_a_step_reads_nothing_back(name, make):
    state = walk(make(), name, seed_noise(0), "cpu")
    assert state.step == 2 and torch.isfinite(state.x).all() and state.x.std() > 0


@pytest.mark.parametrize("name", UNLIKE_OURS)
@pytest.mark.parametrize("make", [our_prior, released_prior])
def test_a_step_on_a_card_has_nothing_on_the_processor(name, make):
    prior = make()
    on_card = ConditionedPrior(prior.prior.to(CARD), None if prior.tone is None else prior.tone.to(CARD))
    state = walk(on_card, name, lambda i: lambda *shape: torch.randn(shape, device=CARD), CARD)
    found = (state.x, state.denoised, *state.lights.parameters(), *state.moments)
    assert {tensor.device.type for tensor in found} == {CARD} and state.moments


@pytest.mark.parametrize(
    "leak",
    [
        lambda t: t.sum().item(),
        lambda t: bool(t.max() > 1),
        lambda t: t[t > 0],
        lambda t: t.cpu(),
        lambda t: t * torch.ones(3),
        lambda t: t.sum() + torch.zeros(2),
        lambda t: torch.tensor([1.0, 2.0, 3.0]).to(CARD),
        lambda t: torch.eye(3) @ torch.ones(3),
    ],
)
def test_the_watch_sees_a_leak(leak):
    """Each of these waits for a card or needs a copy. Some of them PyTorch refuses itself, as `meta` has no values to
    read."""
    tensor = torch.ones(3, device=CARD)
    with pytest.raises((AssertionError, RuntimeError, NotImplementedError)), StaysOn(CARD):
        leak(tensor)


def test_the_watch_sees_a_number_read_on_the_processor():
    with pytest.raises(AssertionError, match="reads a number back"), StaysOn("cpu"):
        torch.ones(3).sum().item()


def test_the_noise_is_of_its_step_and_seed():
    drawn = seed_noise(3, "cpu")(1)(2, 5)
    assert (
        torch.equal(drawn, seed_noise(3)(1)(2, 5))
        and not torch.equal(drawn, seed_noise(3)(2)(2, 5))
        and not torch.equal(drawn, seed_noise(4)(1)(2, 5))
    )
