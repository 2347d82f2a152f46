# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where memory does not suffice the solve goes on in the low-memory mode, says so, and gives the same bytes."""

from types import SimpleNamespace

import pytest
import torch

from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.capture.stages import MAPS, by_name
from core.settings.settings import Settings, from_json
from core.solver.prior.network import UNet, UNetLayout
from core.solver.recipes import Recipe
from core.solver.sampler import Sampler, seed_noise
from core.stages import solve
from core.stages.solve.memory import sample_within_memory
from tests.core.solver.test_sampler import SmoothPrior, observation, shadow_problem, start
from tests.fixtures.painted_skin import make, settings
from tests.fixtures.recorded import changed, record

REFUSALS = [
    MemoryError(),
    torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB"),
    RuntimeError(
        "[enforce fail at alloc_cpu.cpp:117] DefaultCPUAllocator: can't allocate memory: you tried to allocate 99 bytes"
    ),
    RuntimeError("DefaultCPUAllocator: not enough memory: you tried to allocate 99 bytes."),
]


class Refusing:
    """A denoiser that fails at call `at`, or from there on; in the backward pass where asked."""

    def __init__(self, priors, at, error, backward=False, always=False):
        self.priors, self.at, self.error, self.backward, self.always = priors, at, error, backward, always
        self.calls, self.network = 0, SimpleNamespace(low_memory=False)

    def __call__(self, x, sigma, coords):
        self.calls += 1
        out = self.priors[x.shape[-1]](x, sigma, coords)
        if self.calls == self.at or self.always and self.calls > self.at:
            if not self.backward:
                raise self.error
            out.register_hook(self.refuse)
        return out

    def refuse(self, gradient):
        raise self.error


def problem():
    """Observations of a shadow at two sizes, and their denoisers: the map becomes finer within the run."""
    prior, _, texture, mask, _ = shadow_problem(32)
    half = observation(torch.nn.functional.avg_pool2d(texture, 2), torch.nn.functional.avg_pool2d(mask[None], 2)[0])
    recipe = Recipe(steps=6, coarse=((2, 0.5),))
    return {32: prior, 16: SmoothPrior(16)}, {1: observation(texture, mask), 2: half}, recipe


@pytest.fixture(scope="module")
def unbroken():
    priors, seen, recipe = problem()
    sizes = []
    sampler = Sampler(lambda x, s, c: priors[x.shape[-1]](x, s, c), recipe, seed_noise(1))
    out = sampler.sample(seen, start(-0.2), lambda state, steps: sizes.append(state.x.shape[-1]))
    assert sizes[0] == 16 and sizes[-1] == 32
    return out


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("at", [1, 2, 3, 4, 5, 6])
def test_a_step_that_did_not_fit_is_done_again_to_the_same_bytes(unbroken, at, backward):
    priors, seen, recipe = problem()
    prior, said, steps = Refusing(priors, at, REFUSALS[at % len(REFUSALS)], backward), [], []
    out = sample_within_memory(
        Sampler(prior, recipe, seed_noise(1)),
        seen,
        start(-0.2),
        lambda state, of: steps.append(state.step),
        said.append,
    )
    assert torch.equal(out.denoised, unbroken.denoised) and torch.equal(out.x, unbroken.x)
    assert all(torch.equal(a, b) for a, b in zip(out.lights.parameters(), unbroken.lights.parameters(), strict=True))
    assert prior.network.low_memory and len(said) == 1 and f"step {at} of 6" in said[0]
    assert prior.calls == 7 and steps == [1, 2, 3, 4, 5, 6]


def test_lights_that_did_not_fit_start_over_too(unbroken, monkeypatch):
    from core.solver import lights as light_fit

    calls, loss = [], light_fit.light_loss

    def refusing(*given):
        calls.append(1)
        if len(calls) == 30:
            raise MemoryError
        return loss(*given)

    monkeypatch.setattr(light_fit, "light_loss", refusing)
    priors, seen, recipe = problem()
    out = sample_within_memory(Sampler(Refusing(priors, 0, None), recipe, seed_noise(1)), seen, start(-0.2))
    assert torch.equal(out.denoised, unbroken.denoised) and torch.equal(out.lights.grid, unbroken.lights.grid)


@pytest.mark.parametrize("error", REFUSALS)
def test_what_does_not_fit_in_either_mode_is_a_problem_with_a_remedy(error):
    priors, seen, recipe = problem()
    with pytest.raises(Problem, match="step 3 of 6") as raised:
        sample_within_memory(Sampler(Refusing(priors, 3, error, always=True), recipe, seed_noise(1)), seen, start(-0.2))
    assert "smaller map size" in raised.value.remedy


def test_other_errors_are_not_taken_for_a_lack_of_memory():
    priors, seen, recipe = problem()
    prior = Refusing(priors, 2, RuntimeError("mat1 and mat2 shapes cannot be multiplied"))
    with pytest.raises(RuntimeError, match="shapes"):
        sample_within_memory(Sampler(prior, recipe, seed_noise(1)), seen, start(-0.2))
    assert prior.calls == 2 and not prior.network.low_memory


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

            def plain(norm, convolution, x, mapped):
                return convolution(torch.nn.functional.gelu(norm(x, mapped)))

            monkeypatch.setattr("core.solver.prior.network_blocks.Shaped.convolve", plain)
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
    options = {"guidance": "dps", "steps": 4}
    plain, failing, chosen = (make(tmp_path / name) for name in ("plain.wildcap", "failing.wildcap", "chosen.wildcap"))
    solved(plain, **options)
    forward, calls, modes = UNet.forward, [], []

    def watched(network, *given):
        calls.append(1)
        modes.append(network.low_memory)
        if fails and len(calls) == 3:
            raise MemoryError
        return forward(network, *given)

    monkeypatch.setattr(UNet, "forward", watched)
    for capture, fails, low in ((failing, True, False), (chosen, False, True)):
        calls.clear()
        modes.clear()
        said = solved(capture, **options, low_memory=low)
        assert any("step 3 of 4" in line and "low-memory" in line for line in said) == fails
        assert modes[0] == low and modes[-1]
        assert {
            name: (capture.maps / name).read_bytes() == (plain.maps / name).read_bytes() for name in MAPS
        } == dict.fromkeys(MAPS, True)


def solved(capture, **options):
    """Runs the stage; what it said."""
    said = []
    solve.run(
        capture, settings(**options), Reporter("solve", emit=lambda message: said.append(getattr(message, "text", "")))
    )
    return said


def test_how_much_memory_is_used_decides_nothing(tmp_path):
    capture, stage = Capture(tmp_path), by_name("solve")
    record(capture, stage, Settings())
    assert changed(capture, stage, from_json({"solve": {"low_memory": True}})) == ()
    assert changed(capture, stage, from_json({"solve": {"steps": 9}})) == ("solve.steps",)
