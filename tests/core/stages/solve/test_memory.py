# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where memory does not suffice the solve goes on in the low-memory mode, says so, and gives the same bytes."""

from itertools import count
from types import SimpleNamespace

import pytest
import torch

from core.capture.messages import Problem
from core.capture.stages import MAPS
from core.solver import lights
from core.solver.prior.network import UNet, UNetLayout
from core.solver.recipes import Recipe
from core.solver.sampler import Sampler, seed_noise
from core.stages.solve.memory import sample_within_memory
from tests.fixtures.painted_skin import make, settings, solved
from tests.fixtures.small_problems import start, two_sizes

REFUSALS = [
    MemoryError(),
    torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB"),
    RuntimeError("[enforce fail at alloc_cpu.cpp:117] DefaultCPUAllocator: can't allocate memory: 99 bytes"),
    RuntimeError("DefaultCPUAllocator: not enough memory: you tried to allocate 99 bytes."),
]
RECIPE = Recipe(steps=6, coarse=((2, 0.5),), updates=60)
"""The map becomes finer within it."""


class Refusing:
    """A denoiser that fails at call `at`, or from there on; in the backward pass where asked."""

    def __init__(self, at, error, backward=False, always=False):
        self.denoiser, self.seen = two_sizes(RECIPE.coarse)
        self.at, self.error, self.backward, self.always = at, error, backward, always
        self.calls, self.network = 0, SimpleNamespace(low_memory=False)

    def __call__(self, x, sigma, coords):
        self.calls += 1
        out = self.denoiser(x, sigma, coords)
        if self.calls == self.at or self.always and self.calls > self.at:
            if not self.backward:
                raise self.error
            out.register_hook(self.refuse)
        return out

    def refuse(self, gradient):
        raise self.error

    def sample(self, *callbacks):
        return sample_within_memory(Sampler(self, RECIPE, seed_noise(1)), self.seen, start(-0.2), *callbacks)


@pytest.fixture(scope="module")
def unbroken():
    denoiser, seen = two_sizes(RECIPE.coarse)
    sizes = []
    sampler = Sampler(denoiser, RECIPE, seed_noise(1))
    out = sampler.sample(seen, start(-0.2), lambda state, steps: sizes.append(state.x.shape[-1]))
    assert sizes[0] == 16 and sizes[-1] == 32
    return out


@pytest.mark.parametrize(("at", "backward"), [(1, False), (3, True), (5, False), (6, True)])
def test_a_step_that_did_not_fit_is_done_again_to_the_same_bytes(unbroken, at, backward):
    prior, said, steps = Refusing(at, REFUSALS[at % len(REFUSALS)], backward), [], []
    out = prior.sample(lambda state, of: steps.append(state.step), said.append)
    assert torch.equal(out.denoised, unbroken.denoised) and torch.equal(out.x, unbroken.x)
    assert all(torch.equal(a, b) for a, b in zip(out.lights.parameters(), unbroken.lights.parameters(), strict=True))
    assert prior.network.low_memory and len(said) == 1 and f"step {at} of 6" in said[0]
    assert prior.calls == 7 and steps == [1, 2, 3, 4, 5, 6]


def test_lights_that_did_not_fit_start_over_too(unbroken, monkeypatch):
    calls, loss = count(1), lights.light_loss

    def refusing(*given):
        if next(calls) == 30:
            raise MemoryError
        return loss(*given)

    monkeypatch.setattr(lights, "light_loss", refusing)
    out = Refusing(0, None).sample()
    assert torch.equal(out.denoised, unbroken.denoised) and torch.equal(out.lights.grid, unbroken.lights.grid)


def test_what_does_not_fit_in_either_mode_is_a_problem_with_a_remedy():
    with pytest.raises(Problem, match="step 1 of 6") as raised:
        Refusing(1, REFUSALS[0], always=True).sample()
    assert "smaller map size" in raised.value.remedy


def test_other_errors_are_not_taken_for_a_lack_of_memory():
    prior = Refusing(1, RuntimeError("mat1 and mat2 shapes cannot be multiplied"))
    with pytest.raises(RuntimeError, match="shapes"):
        prior.sample()
    assert prior.calls == 1 and not prior.network.low_memory


@pytest.mark.parametrize("norm", ["pixel", "group"])
def test_a_network_that_does_not_learn_keeps_less_for_the_same_gradient(norm, monkeypatch):
    torch.manual_seed(0)
    network = UNet(UNetLayout(3, 2, 32, [1, 2], [32, 32], [False, True], norm=norm))
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, std=0.1)
    network.requires_grad_(False)
    found = []
    for sparing in (True, False):
        if not sparing:
            monkeypatch.setattr(
                "core.solver.prior.network_blocks.Shaped.convolve",
                lambda norm, convolution, x, mapped: convolution(torch.nn.functional.gelu(norm(x, mapped))),
            )
        x, kept = torch.linspace(-1, 1, 5 * 32 * 32).reshape(1, 5, 32, 32).requires_grad_(), {}

        def pack(saved, kept=kept):
            kept[saved.data_ptr()] = saved.nbytes
            return saved

        with torch.autograd.graph.saved_tensors_hooks(pack, lambda saved: saved):
            out = network(x, torch.tensor([0.5]))
        maps = sum(size for size in kept.values() if size >= 32 * 16 * 16 * 4)
        found.append((out.detach(), torch.autograd.grad(out.square().sum(), x)[0], maps))
    assert torch.equal(found[0][0], found[1][0])
    assert torch.equal(found[0][1], found[1][1]) and found[0][1].abs().max() > 0
    assert found[0][2] < 0.6 * found[1][2]


def test_the_stage_falls_back_and_its_maps_are_the_same(tmp_path, monkeypatch):
    """The shipped network: plain, failing once, and with the setting."""
    capture, options = make(tmp_path / "a.wildcap"), {"guidance": "dps", "steps": 4}
    solved(capture, settings(**options))
    plain = {name: (capture.maps / name).read_bytes() for name in MAPS}
    forward, modes = UNet.forward, []

    def watched(network, *given):
        modes.append(network.low_memory)
        if fails and len(modes) == 2:
            raise MemoryError
        return forward(network, *given)

    monkeypatch.setattr(UNet, "forward", watched)
    for fails, low in ((True, False), (False, True)):
        modes.clear()
        said = solved(capture, settings(**options, low_memory=low))
        assert any("step 2 of 4" in line and "low-memory" in line for line in said) == fails
        assert modes[0] == low and modes[-1]
        assert {name: (capture.maps / name).read_bytes() for name in MAPS} == plain
