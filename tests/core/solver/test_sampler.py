# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler on problems small enough to know the answer: a Gaussian prior with its closed-form posterior, and a
shadow to remove."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture.messages import Problem
from core.solver.lighting import Lights, Shader, constant_light
from core.solver.lights import light_loss, update_lights
from core.solver.objective import Observation, State
from core.solver.prior.prior import make_coordinates
from core.solver.recipes import RECIPES, Recipe
from core.solver.sampler import Sampler, ancestral_sigmas, karras_sigmas, noise_schedule, seed_noise
from core.stages.solve import checkpoint
from core.stages.solve.refusals import tell_refusals

SIZE = 32
MEAN, SPREAD = 0.1, 0.3
EVEN = Recipe(steps=40, coarse=())


def gaussian_prior(x, sigma, coords):
    """The exact denoiser of independent texels N(MEAN, SPREAD^2)."""
    return MEAN + (x - MEAN) * SPREAD**2 / (SPREAD**2 + sigma**2)


class SmoothPrior:
    """The exact denoiser of fields with a 1/f-like spectrum around a mean."""

    def __init__(self, size, mean=-0.2, seed=0):
        f = torch.fft.fftfreq(size)
        radius = (f[:, None] ** 2 + f[None] ** 2).sqrt() * size
        self.power = 40.0 * (SPREAD * size / 32) ** 2 / (1 + radius) ** 3
        self.mean = mean

    def __call__(self, x, sigma, coords):
        spectrum = torch.fft.fft2(x - self.mean)
        return torch.fft.ifft2(spectrum * (self.power / (self.power + sigma**2))).real + self.mean

    def draw(self, generator):
        white = torch.fft.fft2(torch.randn(1, 7, *self.power.shape, generator=generator))
        return torch.fft.ifft2(white * self.power.sqrt()).real + self.mean


def observation(texture, alpha=None, cells=(4, 4), weight=None):
    size = texture.shape[-1]
    alpha = torch.zeros(size, size) if alpha is None else alpha
    line = torch.linspace(-0.8, 0.8, size)
    y, x = torch.meshgrid(line, line, indexing="ij")
    normal = torch.nn.functional.normalize(torch.stack([x, -torch.ones_like(x), -y]), dim=0)
    ring = (torch.nn.functional.max_pool2d((alpha > 0).float()[None, None], 5, 1, 2)[0, 0] > 0) & (alpha < 0.5)
    weight = torch.ones(size, size) if weight is None else weight
    coords = make_coordinates(size, slice(0, size), slice(0, size))
    return Observation(texture, weight, torch.ones(size, size), coords, Shader(normal, alpha, cells), ring, 1024 / size)


def start(value=0.0, size=SIZE, light=1.0, cells=(4, 4)):
    return State(
        0,
        None,
        torch.full((1, 7, size, size), value),
        Lights(constant_light(torch.full((3,), light)), torch.zeros(1, 9, *cells), torch.ones(3)),
    )


def test_schedule_walks_the_last_part_of_karras_sequence():
    sigmas = noise_schedule(Recipe(steps=599, start=0.599))
    assert len(sigmas) == 600 and sigmas[-1] == 0 and abs(sigmas[0] - 7.26) < 0.02
    assert all(a > b for a, b in zip(sigmas, sigmas[1:], strict=False))
    for s, s_next in zip(sigmas, sigmas[1:], strict=False):
        down, up = ancestral_sigmas(s, s_next)
        assert abs(down**2 + up**2 - s_next**2) < 1e-9 * s**2
    sigmas = karras_sigmas(10, 0.01, 80.0)
    assert sigmas[0] == pytest.approx(80) and sigmas[9] == pytest.approx(0.01)


def test_without_observation_the_sampler_draws_from_the_prior():
    o = observation(torch.zeros(3, SIZE, SIZE), weight=torch.zeros(SIZE, SIZE))
    drawn = torch.cat(
        [Sampler(gaussian_prior, EVEN, seed_noise(seed)).sample({1: o}, start()).denoised for seed in range(3)]
    )
    assert abs(drawn.mean().item() - MEAN) < 0.02
    assert abs(drawn.std().item() - SPREAD) < 0.03


@pytest.mark.parametrize("guidance", ["dps", "proximal"])
def test_posterior_mean_under_a_gaussian_prior(guidance):
    """Albedo observed under known light: the samples' mean is the closed-form posterior's (noise-free: the
    observation), other channels stay the prior's."""
    generator = torch.Generator().manual_seed(3)
    truth = MEAN + SPREAD * torch.randn(1, 7, SIZE, SIZE, generator=generator)
    light = 1.2
    texture = light * (truth[0, :3] + 1) / 2
    weight = torch.ones(SIZE, SIZE)
    weight[:, SIZE // 2 :] = 0.0  # the right half is unseen: its posterior is the prior
    recipe = Recipe(steps=75, coarse=(), guidance=guidance, rate=0.0)
    o = {1: observation(texture, weight=weight)}
    drawn = torch.stack(
        [
            Sampler(gaussian_prior, recipe, seed_noise(seed)).sample(o, start(light=light)).denoised[0]
            for seed in range(12)
        ]
    )
    seen, unseen = drawn[:, :3, :, : SIZE // 2], drawn[:, :3, :, SIZE // 2 :]
    assert (seen.mean(0) - truth[0, :3, :, : SIZE // 2]).abs().mean() < 0.02
    assert seen.std(0).mean() < 0.04
    assert abs(unseen.mean().item() - MEAN) < 0.02
    assert abs(unseen.std().item() - SPREAD) < 0.03
    assert abs(drawn[:, 3:].std().item() - SPREAD) < 0.03


def shadow_problem(size=64, seed=0):
    prior = SmoothPrior(size)
    truth = prior.draw(torch.Generator().manual_seed(seed))
    y, x = np.mgrid[:size, :size]
    soft = 1 / (1 + np.exp(-(14 - np.hypot(x - 30, y - 34)) / 1.5))
    mask = torch.from_numpy((np.hypot(x - 30, y - 34) < 20).astype(np.float32))
    texture = (truth[0, :3] + 1) / 2 * torch.from_numpy(1 - 0.55 * soft).float()
    return prior, truth, texture, mask, torch.from_numpy(soft > 0.5)


def test_a_known_soft_shadow_is_removed_and_only_with_the_grid():
    prior, truth, texture, mask, shadow = shadow_problem()
    recipe = Recipe(steps=60, coarse=())
    errors = {}
    for name, alpha in (("grid", mask), ("no grid", torch.zeros_like(mask))):
        out = Sampler(prior, recipe, seed_noise(0)).sample(
            {1: observation(texture, alpha, (8, 8))}, start(-0.2, 64, cells=(8, 8))
        )
        error = ((out.denoised - truth)[0, :3] / 2) ** 2
        errors[name] = error[:, shadow].mean().sqrt().item(), error[:, mask == 0].mean().sqrt().item()
    assert errors["grid"][0] < 0.6 * errors["no grid"][0]
    assert errors["grid"][1] < 0.03


@pytest.mark.parametrize("name", [name for name in RECIPES if name != "wildcap"])
def test_the_paper_and_its_code_remove_a_known_shadow_too(name):
    """As they are, on a map that is small enough for their 600 steps."""
    prior, truth, texture, mask, shadow = shadow_problem()
    recipe = RECIPES[name]
    support = torch.nn.functional.max_pool2d(mask[None, None], 5, 1, 2)[0, 0]
    o = observation(texture, support, (8, 8))
    first = start(-0.2, 64, cells=(8, 8))
    first.lights.grid = torch.zeros(3, 9, 8, 8)
    out = Sampler(prior, recipe, seed_noise(0)).sample({1: o}, first)
    error, before = ((out.denoised - truth)[0, :3] / 2).abs(), (texture - (truth[0, :3] + 1) / 2).abs()
    assert error[:, shadow].mean() < 0.7 * before[:, shadow].mean()
    # lights fitted one after the other leave more outside than lights fitted together
    assert error[:, support == 0].mean() < 0.05


def test_the_lights_move_as_far_on_a_finer_map_as_on_a_coarse_one():
    """On maps that are even there is no difference between the sizes but the number of texels, which Adam ignores."""
    found = []
    for coarse in ((), ((2, 1.0),)):
        seen = {factor: observation(torch.full((3, SIZE // factor, SIZE // factor), 0.2)) for factor in (1, 2)}
        seen = {
            factor: replace(
                o,
                shader=Shader(
                    torch.tensor([0.0, 0, 1])[:, None, None].expand(3, *o.weight.shape), 0 * o.weight, (4, 4)
                ),
            )
            for factor, o in seen.items()
        }
        recipe = Recipe(steps=20, coarse=coarse, phases=(("main", 0.0, 1.0),), updates=60)
        sampler = Sampler(
            lambda x, sigma, coords: torch.zeros_like(x),
            replace(recipe, guidance="proximal"),
            seed_noise(0),
            fit=lambda state, denoised, *rest: update_lights(state, 0 * denoised, *rest),
        )
        found.append(sampler.sample(seen, start()).lights.glob)
    assert (found[0] - start().lights.glob).abs().max() > 0.1
    assert torch.allclose(found[0], found[1], atol=1e-4), (found[0] - found[1]).abs().max()


def test_the_paper_s_total_variation_is_of_all_gamma_and_counts_the_mask_s_border():
    """Supplement, "Lighting Regularization": of gamma^g + gamma^V M. Under one light in all cells only M's border
    varies, by that light, once per pair of texels that it parts."""
    alpha = torch.zeros(32, 32)
    alpha[8:20, 10:22] = 1
    clean = SmoothPrior(32).draw(torch.Generator().manual_seed(0))
    lights, o = start().lights, observation((clean[0, :3] + 1) / 2, alpha)
    lights.grid = torch.zeros(3, 9, 4, 4)
    lights.grid[:, 0] = -0.2
    recipe = replace(RECIPES["paper"], neg=0.0)
    cost = light_loss(lights, clean, o, recipe) - light_loss(lights, clean, o, replace(recipe, tv=0.0))
    assert cost.item() == pytest.approx(recipe.tv * 4 * 12 * 3 * 0.2**2, rel=1e-3)


def test_the_same_seed_gives_the_same_bytes_and_another_does_not():
    prior, _, texture, mask, _ = shadow_problem(32)
    o = {1: observation(texture, mask)}
    a, b, c = (
        Sampler(prior, Recipe(steps=12, coarse=()), seed_noise(seed)).sample(o, start(-0.2)).denoised
        for seed in (5, 5, 6)
    )
    assert torch.equal(a, b) and not torch.equal(a, c)


@pytest.mark.parametrize("coarse", [(), ((2, 0.5),)])
def test_resuming_from_a_checkpoint_gives_the_same_bytes(tmp_path, coarse):
    prior, _, texture, mask, _ = shadow_problem(32)
    half = observation(torch.nn.functional.avg_pool2d(texture, 2), torch.nn.functional.avg_pool2d(mask[None], 2)[0])
    o = {1: observation(texture, mask), 2: half}
    priors = {32: prior, 16: SmoothPrior(16)}

    def denoiser(x, sigma, coords):
        return priors[x.shape[-1]](x, sigma, coords)

    recipe = Recipe(steps=16, coarse=coarse)
    path = tmp_path / "solve.safetensors"

    def store(state, steps):
        if state.step == 5:
            checkpoint.write_state(path, state, "key")

    whole = Sampler(denoiser, recipe, seed_noise(1)).sample(o, start(-0.2), store)
    assert checkpoint.read_state(path, "another key") is None
    resumed = Sampler(denoiser, recipe, seed_noise(1)).sample(o, checkpoint.read_state(path, "key"))
    assert torch.equal(whole.denoised, resumed.denoised) and torch.equal(whole.lights.grid, resumed.lights.grid)
    path.write_bytes(path.read_bytes()[:1000])
    assert checkpoint.read_state(path, "key") is None


@pytest.mark.parametrize("kind", ["empty", "full", "one texel"])
@pytest.mark.parametrize("guidance", ["dps", "proximal"])
def test_any_mask_gives_finite_maps(kind, guidance):
    prior, truth, texture, _, _ = shadow_problem(32)
    alpha = {"empty": torch.zeros(32, 32), "full": torch.ones(32, 32), "one texel": torch.zeros(32, 32)}[kind]
    if kind == "one texel":
        alpha[7, 9] = 1
    sampler = Sampler(prior, Recipe(steps=20, coarse=(), guidance=guidance), seed_noise(0))
    out = sampler.sample({1: observation(texture, alpha)}, start(-0.2))
    assert torch.isfinite(out.denoised).all()
    assert ((out.denoised - truth)[0, :3, 20:] / 2).abs().mean() < (0.1 if kind != "full" else 0.5)


def test_divergence_is_a_problem_with_a_remedy():
    o = {1: observation(torch.full((3, SIZE, SIZE), float("nan")))}
    with pytest.raises(Problem, match="diverged at step 1"), tell_refusals():
        Sampler(gaussian_prior, EVEN, seed_noise(0)).sample(o, start())
