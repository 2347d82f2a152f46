# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler on problems small enough to know the answer: a Gaussian prior with its closed-form posterior, and a
shadow to remove."""

from dataclasses import replace

import pytest
import torch
from torch.nn import functional

from core.capture.messages import Problem
from core.solver.lighting import Shader
from core.solver.lights import light_loss, update_lights
from core.solver.recipes import RECIPES, Recipe
from core.solver.sampler import Sampler, ancestral_sigmas, karras_sigmas, noise_schedule, seed_noise
from core.stages.solve import checkpoint
from core.stages.solve.refusals import tell_refusals
from tests.fixtures.small_problems import SIZE, SPREAD, SmoothPrior, observation, shadow_problem, start, two_sizes

MEAN = 0.1
EVEN = Recipe(steps=40, coarse=())


def gaussian_prior(x, sigma, coords):
    """The exact denoiser of independent texels N(MEAN, SPREAD^2)."""
    return MEAN + (x - MEAN) * SPREAD**2 / (SPREAD**2 + sigma**2)


def test_schedule_walks_the_last_part_of_karras_sequence():
    sigmas = noise_schedule(Recipe(steps=599, start=0.599))
    assert len(sigmas) == 600 and sigmas[-1] == 0 and abs(sigmas[0] - 7.26) < 0.02
    for s, s_next in zip(sigmas, sigmas[1:], strict=False):
        down, up = ancestral_sigmas(s, s_next)
        assert s > s_next and abs(down**2 + up**2 - s_next**2) < 1e-9 * s**2
    sigmas = karras_sigmas(10, 0.01, 80.0)
    assert sigmas[0] == pytest.approx(80) and sigmas[9] == pytest.approx(0.01)


def test_the_noise_is_of_its_step_and_seed():
    drawn = seed_noise(3, "cpu")(1)(2, 5)
    assert torch.equal(drawn, seed_noise(3)(1)(2, 5))
    assert not torch.equal(drawn, seed_noise(3)(2)(2, 5)) and not torch.equal(drawn, seed_noise(4)(1)(2, 5))


@pytest.mark.parametrize("guidance", ["dps", "proximal"])
def test_posterior_mean_under_a_gaussian_prior(guidance):
    """Albedo observed under known light: the samples' mean is the closed-form posterior's (noise-free: the
    observation); other channels and unseen texels stay the prior's."""
    truth = MEAN + SPREAD * torch.randn(1, 7, SIZE, SIZE, generator=torch.Generator().manual_seed(3))
    weight = torch.ones(SIZE, SIZE)
    weight[:, SIZE // 2 :] = 0.0
    o = {1: observation(1.2 * (truth[0, :3] + 1) / 2, weight=weight)}
    recipe = Recipe(steps=75, coarse=(), guidance=guidance, phases=())
    samplers = [Sampler(gaussian_prior, recipe, seed_noise(seed)) for seed in range(6)]
    drawn = torch.stack([sampler.sample(o, start(light=1.2)).denoised[0] for sampler in samplers])
    seen, unseen = drawn[:, :3].chunk(2, -1)
    assert (seen.mean(0) - truth[0, :3, :, : SIZE // 2]).abs().mean() < 0.02
    assert seen.std(0).mean() < 0.04
    assert abs(unseen.mean().item() - MEAN) < 0.02
    assert abs(unseen.std().item() - SPREAD) < 0.03
    assert abs(drawn[:, 3:].std().item() - SPREAD) < 0.03


def test_a_known_soft_shadow_is_removed_and_only_with_the_grid():
    prior, truth, texture, mask, shadow = shadow_problem()
    errors = []
    for alpha in (mask, torch.zeros_like(mask)):
        o = observation(texture, alpha, (8, 8))
        sampler = Sampler(prior, Recipe(steps=60, coarse=(), updates=150), seed_noise(0))
        out = sampler.sample({1: o}, start(-0.2, 64, cells=(8, 8)))
        error = ((out.denoised - truth)[0, :3] / 2) ** 2
        errors.append((error[:, shadow].mean().sqrt().item(), error[:, mask == 0].mean().sqrt().item()))
    with_grid, without = errors
    assert with_grid[0] < 0.6 * without[0] and with_grid[1] < 0.03


@pytest.mark.parametrize("name", ["paper", "released"])
def test_the_paper_and_its_code_remove_a_known_shadow_too(name):
    """In a third of their steps."""
    prior, truth, texture, mask, shadow = shadow_problem()
    support = functional.max_pool2d(mask[None, None], 5, 1, 2)[0, 0]
    recipe = replace(RECIPES[name], steps=200, updates=600 if name == "paper" else 1)
    sampler = Sampler(prior, recipe, seed_noise(0))
    out = sampler.sample({1: observation(texture, support, (8, 8))}, start(-0.2, 64, cells=(8, 8), colours=3))
    error, before = ((out.denoised - truth)[0, :3] / 2).abs(), (texture - (truth[0, :3] + 1) / 2).abs()
    assert error[:, shadow].mean() < 0.7 * before[:, shadow].mean()
    # lights fitted one after the other leave more outside than lights fitted together
    assert error[:, support == 0].mean() < 0.05


def test_the_lights_move_as_far_on_a_finer_map_as_on_a_coarse_one():
    """On even maps the sizes differ in the number of texels alone, which Adam ignores."""
    up, seen, found = torch.tensor([0.0, 0, 1])[:, None, None], {}, []
    for factor in (1, 2):
        o = observation(torch.full((3, SIZE // factor, SIZE // factor), 0.2))
        seen[factor] = replace(o, shader=Shader(up.expand(3, *o.weight.shape), 0 * o.weight, (4, 4)))
    recipe = Recipe(steps=20, phases=(("main", 0.0, 1.0),), updates=60, guidance="proximal")
    for coarse in ((), ((2, 1.0),)):
        sampler = Sampler(
            lambda x, sigma, coords: torch.zeros_like(x),
            replace(recipe, coarse=coarse),
            seed_noise(0),
            fit=lambda state, denoised, *rest: update_lights(state, 0 * denoised, *rest),
        )
        found.append(sampler.sample(seen, start()).lights.glob)
    assert (found[0] - start().lights.glob).abs().max() > 0.1
    assert torch.allclose(found[0], found[1], atol=1e-4)


def test_the_paper_s_total_variation_is_of_all_gamma_and_counts_the_mask_s_border():
    """Supplement, "Lighting Regularization": of gamma^g + gamma^V M. Under one light in all cells only M's border
    varies, by that light, once per pair of texels that it parts."""
    alpha = torch.zeros(32, 32)
    alpha[8:20, 10:22] = 1
    clean = SmoothPrior(32).draw(torch.Generator().manual_seed(0))
    lights, o = start(colours=3).lights, observation((clean[0, :3] + 1) / 2, alpha)
    lights.grid[:, 0] = -0.2
    recipe = replace(RECIPES["paper"], neg=0.0)
    cost = light_loss(lights, clean, o, recipe) - light_loss(lights, clean, o, replace(recipe, tv=0.0))
    assert cost.item() == pytest.approx(recipe.tv * 4 * 12 * 3 * 0.2**2, rel=1e-3)


@pytest.mark.parametrize("coarse", [(), ((2, 0.5),)])
def test_resuming_from_a_checkpoint_gives_the_same_bytes_and_another_seed_does_not(tmp_path, coarse):
    denoiser, o = two_sizes(coarse)
    recipe, path = Recipe(steps=12, coarse=coarse), tmp_path / "solve.safetensors"

    def store(state, steps):
        if state.step == 5:
            checkpoint.write_state(path, state, "key")

    whole = Sampler(denoiser, recipe, seed_noise(1)).sample(o, start(-0.2), store)
    assert checkpoint.read_state(path, "another key") is None
    resumed = Sampler(denoiser, recipe, seed_noise(1)).sample(o, checkpoint.read_state(path, "key"))
    assert torch.equal(whole.denoised, resumed.denoised) and torch.equal(whole.lights.grid, resumed.lights.grid)
    other = Sampler(denoiser, recipe, seed_noise(2)).sample(o, checkpoint.read_state(path, "key"))
    assert not torch.equal(whole.denoised, other.denoised)
    path.write_bytes(path.read_bytes()[:1000])
    assert checkpoint.read_state(path, "key") is None


@pytest.mark.parametrize("kind", ["full", "one texel"])
@pytest.mark.parametrize("guidance", ["dps", "proximal"])
def test_any_mask_gives_finite_maps(kind, guidance):
    prior, truth, texture, _, _ = shadow_problem(32)
    alpha = torch.full((32, 32), float(kind == "full"))
    alpha[7, 9] = 1
    recipe = Recipe(steps=20, coarse=(), guidance=guidance, updates=100)
    out = Sampler(prior, recipe, seed_noise(0)).sample({1: observation(texture, alpha)}, start(-0.2))
    assert torch.isfinite(out.denoised).all()
    assert ((out.denoised - truth)[0, :3, 20:] / 2).abs().mean() < (0.1 if kind != "full" else 0.5)


def test_divergence_is_a_problem():
    o = {1: observation(torch.full((3, SIZE, SIZE), float("nan")))}
    with pytest.raises(Problem, match="diverged at step 1"), tell_refusals():
        Sampler(gaussian_prior, EVEN, seed_noise(0)).sample(o, start())
