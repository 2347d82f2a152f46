# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
r"""Joint sampling of reflectance and light (paper, section 3.4, equations 5 to 8).

The paper writes DDPM; here the same process has the variance-exploding form of EDM: x = x_0 + sigma z, one ancestral
step of which is the DDPM posterior step (equation 5), and the denoiser's output is \hat x_t (equation 6). Everything is
float32 and linear light; x is [1, 7, H, W].

A step stays on the device of the state, the observations and the prior: it neither reads a number back nor sends one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch

from .lighting import Lights, interpolation_matrix
from .lights import update_lights
from .objective import Observation, State, albedo, blur_maps, photometric_loss
from .recipes import Recipe


class DivergedError(ArithmeticError):
    """Sampling diverged."""


def seed_noise(seed: int, device: torch.device | str = "cpu") -> Callable[[int], Callable]:
    """Return a run's noise: step -> draw(*shape), standard normal, drawn on the device.

    It depends on (seed, step, device) alone, so a run continued from a stored state gives the same bytes.
    """

    def of_step(step: int) -> Callable:
        generator = torch.Generator(device).manual_seed(1_000_003 * seed + step)
        return lambda *shape: torch.randn(shape, generator=generator, device=device)

    return of_step


@dataclass(frozen=True)
class Sampler:
    """Sampling method, whatever is observed of the map.

    denoiser(x, sigma, coords) is the prior; noise is `seed_noise`'s, of the observations' device; impose_known(x,
    sigma, draw) puts into x_t what is certain of the map (window.py); fit moves theta after each step (`update_lights`,
    or another light model's).
    """

    denoiser: Callable
    recipe: Recipe
    noise: Callable[[int], Callable]
    impose_known: Callable[[torch.Tensor, float, Callable], torch.Tensor] = lambda x, sigma, draw: x
    fit: Callable[..., None] = update_lights

    def sample(
        self,
        observations: dict[int, Observation],
        state: State,
        on_step: Callable[[State, int], None] = lambda state, steps: None,
    ) -> State:
        """Sample from `state` to the end and return the final state: `denoised` is the solved map, `lights` theta.

        `observations` maps a coarsening factor to what was observed at that size. Raises DivergedError.
        """
        sigmas = noise_schedule(self.recipe)
        steps = len(sigmas) - 1
        for i in range(state.step, steps):
            s = sigmas[i]
            draw = self.noise(i)
            o = observations[_factor(s, self.recipe, observations)]
            if state.x is None or state.x.shape[-2:] != o.weight.shape:  # the start, or a finer map from here on
                clean = _resized(state.denoised, *o.weight.shape)
                state.x = clean + s * draw(*clean.shape)
                # the lights' cost is a sum over texels, and Adam's memory of its gradient is longer than a size lasts
                growth = o.weight.numel() / state.denoised[0, 0].numel()
                state.moments = [moment * growth ** (1 + k % 2) for k, moment in enumerate(state.moments)]
            self.step(o, state, (s, sigmas[i + 1]), steps, draw)
            if not state.x.abs().max() <= 1e3 * (1 + s):  # nor where it is no number
                raise DivergedError(f"The solver diverged at step {i + 1} of {steps}.")
            on_step(state, steps)
        return state

    def step(self, o: Observation, state: State, levels: tuple[float, float], steps: int, draw: Callable) -> None:
        """Take one step of `steps` in place: x_t becomes x_{t-1}, theta follows.

        `o` has the size of the state's x, `levels` is sigma before and after the step, draw(*shape) is its noise.
        """
        (s, s_next), recipe = levels, self.recipe
        x = self.impose_known(state.x, s, draw).requires_grad_(recipe.guidance == "dps")
        denoised = self.denoiser(x, s, o.coords)  # equation 6
        with torch.no_grad():
            shading = o.shader.total(state.lights)
        guided, gradient = denoised.detach(), 0.0
        if recipe.guidance == "dps":
            loss = photometric_loss(denoised, shading, o, o.weight, recipe.blur)  # equation 1
            scale = recipe.zeta * (1 + s * s if recipe.preserving else 1.0)
            gradient = clip_gradient(torch.autograd.grad(loss, x)[0] * o.weight * scale, recipe)
        else:
            guided = proximal_step(guided, shading, o, s, recipe.residual)
        self.fit(state, denoised.detach(), o, recipe, state.step, steps)  # equation 9

        with torch.no_grad():
            s_down, s_up = ancestral_sigmas(s, s_next)
            x = x.detach()
            x_prime = x + (x - guided) / s * (s_down - s)  # equation 7, its mean
            x_prime = x_prime - gradient  # equation 8
            state.x = x_prime if s_up == 0 else self._noised(x_prime, x, (s_up, s_down / s), o, state.lights, draw)
        state.denoised, state.step = guided, state.step + 1

    def _noised(
        self,
        mean: torch.Tensor,
        x: torch.Tensor,
        shares: tuple[float, float],
        o: Observation,
        lights: Lights,
        draw: Callable,
    ) -> torch.Tensor:
        """Return x_{t-1}, the mean with fresh noise; `shares` are its level and the share of x_t's noise that is kept.

        Of several draws the one counts whose rendering is nearest to where x_t's should go (diffusion proximal
        posterior sampling, as in the released code).
        """
        s_up, kept = shares
        if self.recipe.candidates == 1:
            return mean + s_up * draw(*mean.shape)
        shading = o.shader.total(lights)
        target = kept * blur_maps(albedo(x) * shading) + (1 - kept) * o.texture
        best, least = mean, torch.full((), torch.inf, device=mean.device)
        for _ in range(self.recipe.candidates):
            candidate = mean + s_up * draw(*mean.shape)
            error = ((o.weight * (shading * albedo(candidate) - target)) ** 2).sum()
            best, least = torch.where(error < least, candidate, best), torch.minimum(error, least)
        return best


def noise_schedule(recipe: Recipe) -> list[float]:
    """Return the last `steps` noise levels of a Karras sequence of which they are the share `start`, then 0."""
    count = max(recipe.steps, round(recipe.steps / recipe.start))
    return karras_sigmas(count, recipe.sigma_min, recipe.sigma_max)[-recipe.steps - 1 :]


def karras_sigmas(count: int, sigma_min: float, sigma_max: float) -> list[float]:
    """Return `count` noise levels from sigma_max to sigma_min and a final 0 (Karras et al. 2022, equation 5, rho 7)."""
    low, high = sigma_min ** (1 / 7), sigma_max ** (1 / 7)
    ramp = torch.linspace(0, 1, count, dtype=torch.float64)
    return [*((high + ramp * (low - high)) ** 7).tolist(), 0.0]


def ancestral_sigmas(s: float, s_next: float) -> tuple[float, float]:
    """Return (s_down, s_up): a step down to s_down and s_up of fresh noise keep the process's variance."""
    s_up = min(s_next, (s_next**2 * (s**2 - s_next**2) / s**2) ** 0.5)
    return (s_next**2 - s_up**2) ** 0.5, s_up


def clip_gradient(gradient: torch.Tensor, recipe: Recipe) -> torch.Tensor:
    """Limit the guidance [1, 7, H, W] texel by texel, so that one bad texel does not hold up the others, or as one."""
    if recipe.clip == "texel":
        return gradient * (recipe.limit / gradient.abs().amax(1, keepdim=True).clamp_min(recipe.limit))
    if recipe.clip == "decade":
        tenths = (gradient.abs().max() / recipe.limit).log10().ceil().clamp_min(0)
        return gradient * 0.1**tenths
    return gradient


def proximal_step(
    denoised: torch.Tensor, shading: torch.Tensor, o: Observation, s: float, residual: float
) -> torch.Tensor:
    """Return the map nearest to `denoised` that explains the texture: per texel, in closed form (Zhu et al. 2023).

    The map [1, 7, H, W] has the deviation `s`, the texture `residual` about its explanation. Normals and specular stay.
    """
    half = shading / 2 * o.weight
    ratio = (residual / s) ** 2
    wanted = o.texture * o.weight - half
    out = denoised.clone()
    out[0, :3] = (half * wanted + ratio * denoised[0, :3]) / (half * half + ratio)
    return out


def _factor(s: float, recipe: Recipe, observations: dict[int, Observation]) -> int:
    return next((factor for factor, above in recipe.coarse if s > above and factor in observations), 1)


def _resized(maps: torch.Tensor, height: int, width: int) -> torch.Tensor:
    if maps.shape[-2:] == (height, width):
        return maps
    rows, columns = (
        interpolation_matrix(old, new).to(maps) for old, new in zip(maps.shape[-2:], (height, width), strict=True)
    )
    return rows @ maps @ columns.T
