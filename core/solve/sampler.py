# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joint sampling of reflectance and light (paper, section 3.4, "Jointly Sample A and Update Gamma").

The paper writes DDPM; here the same process stands in the variance-exploding form of EDM: x = x_0 + sigma z, one ancestral step of which is the DDPM
posterior step (equation 5), and the denoiser's output is \\hat x_t (equation 6). Everything is float32 and linear light; x is [1, 7, H, W].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import torch
from torch.nn import functional

from ..messages import Problem
from .lighting import BANDS, Lights, Shader, interpolation

BETAS = 0.9, 0.999
BAND_OF = torch.tensor([BANDS[0]] + [BANDS[1]] * 3 + [BANDS[2]] * 5)


@dataclass(frozen=True)
class Recipe:
    """The constants of the method. The defaults are the released code's unless a comment says otherwise."""

    steps: int = 75
    start: float = 0.6  # T_init / T: the share of the noise schedule that is walked
    sigma_min: float = 0.01
    sigma_max: float = 80.0
    guidance: str = "dps"  # or "proximal": closed form on the denoised map, without the network's gradient
    zeta: float = 1.0  # step size of equation 8
    clip: float = 0.1  # largest guidance of one texel
    residual: float = 0.02  # proximal: the photometric error that is taken for noise
    light_rate: float = 0.01
    light_decay: float = 0.995
    light_updates: int = 300  # updates of theta in all ...
    light_share: float = 0.5  # ... over this share of the steps; then the light is frozen
    tv: float = 0.1
    smooth: float = 1.4  # L1 variation of s^V inside M, per texel of a 1024 map and mean squared albedo: a brow is not worth its outline, a shadow is
    neg: float = 1.0
    even: float = 0.0  # pull of gamma^g towards an even light, per texel and mean squared albedo
    faint: float = 0.0  # pull of s^V towards zero, likewise
    one_chroma: bool = True  # all local light has one learned colour; False: 27 free numbers per cell, as in the paper
    coarse: tuple[tuple[int, float], ...] = ((4, 1.0), (2, 0.3))  # (factor, sigma): above this noise the map is sampled at 1 / factor of its size


@dataclass(frozen=True)
class Observation:
    """What is known of the map at one size.

    texture I_UV [3, H, W], scaled so that its shading is about one; weight [H, W] in [0, 1]: how far a texel's observation counts;
    trust [H, W] in [0, 1]: how far what is seen there may be explained as light (less for brows, lips and hair); coords [1, 2, H, W] for the prior;
    shader Gamma with N_c and M; ring [H, W]: where L_TV counts; texel: side of a texel in texels of a 1024 map.
    """

    texture: torch.Tensor
    weight: torch.Tensor
    trust: torch.Tensor
    coords: torch.Tensor
    shader: Shader
    ring: torch.Tensor
    texel: float = 1.0


@dataclass
class State:
    """Where the sampling stands before step `step`. denoised is \\hat x of the step before (first: x_0^ref); moments are Adam's."""

    step: int
    x: torch.Tensor | None
    denoised: torch.Tensor
    lights: Lights
    moments: list[torch.Tensor] = field(default_factory=list)
    updates: int = 0


def sample(prior: Callable, observations: dict[int, Observation], state: State, recipe: Recipe, seed: int,
           on_step: Callable[[State, int], None] = lambda state, steps: None) -> State:
    """Runs the sampler from `state` to its end and returns the final state; `denoised` is the solved map, `lights` theta.

    prior(x, sigma, coords) is the denoiser; `observations` maps a coarsening factor to what is known at that size. The noise of a step depends on
    (seed, step) alone, so a run continued from a stored state gives the same bytes. Raises Problem when the numbers leave all bounds.
    """
    sigmas = schedule(recipe)
    steps = len(sigmas) - 1
    light_steps = max(1, round(steps * recipe.light_share))
    updates_per_step = max(1, round(recipe.light_updates / light_steps))
    for i in range(state.step, steps):
        s, s_next = sigmas[i], sigmas[i + 1]
        noise = torch.Generator().manual_seed(1_000_003 * seed + i)
        o = observations[_factor(s, recipe, observations)]
        if state.x is None or state.x.shape[-2:] != o.weight.shape:  # the start, or a finer map from here on
            clean = _resized(state.denoised, *o.weight.shape)
            state.x = clean + s * torch.randn(clean.shape, generator=noise)

        x = state.x.requires_grad_(recipe.guidance == "dps")
        denoised = prior(x, s, o.coords)  # equation 6
        with torch.no_grad():
            shading = o.shader.total(state.lights)
        guided, gradient = denoised.detach(), torch.zeros(())
        if recipe.guidance == "dps":
            loss = photometric(denoised, shading, o, o.weight)  # equation 1
            gradient = clipped(torch.autograd.grad(loss, x)[0] * o.weight, recipe.clip)
        else:
            guided = proximal(guided, shading, o, s, recipe.residual)
        if i < light_steps:
            for _ in range(updates_per_step):  # equation 9
                update_lights(state, denoised.detach(), o, recipe)

        with torch.no_grad():
            s_down, s_up = ancestral(s, s_next)
            x = x.detach()
            x_prime = x + (x - guided) / s * (s_down - s)  # equation 7
            if s_up > 0:
                x_prime = x_prime + s_up * torch.randn(x.shape, generator=noise)
            state.x = x_prime - recipe.zeta * gradient  # equation 8
        state.denoised, state.step = guided, i + 1
        if not torch.isfinite(state.x).all() or state.x.abs().max() > 1e3 * (1 + s):
            raise Problem(f"The solver diverged at step {i + 1} of {steps}.",
                          "Check that the texture and the mask are those of this head, or choose the proximal guidance.")
        on_step(state, steps)
    return state


def schedule(recipe: Recipe) -> list[float]:
    """Noise levels: the last `steps` of Karras' sequence (rho 7) whose length makes them the share `start` of it, then 0."""
    count = max(recipe.steps, round(recipe.steps / recipe.start))
    return karras(count, recipe.sigma_min, recipe.sigma_max)[-recipe.steps - 1:]


def karras(count: int, sigma_min: float, sigma_max: float) -> list[float]:
    """`count` noise levels from sigma_max to sigma_min and a final 0 (Karras et al. 2022, equation 5, rho 7)."""
    low, high = sigma_min ** (1 / 7), sigma_max ** (1 / 7)
    ramp = torch.linspace(0, 1, count, dtype=torch.float64)
    return [*((high + ramp * (low - high)) ** 7).tolist(), 0.0]


def ancestral(s: float, s_next: float) -> tuple[float, float]:
    """(s_down, s_up) of a step that keeps the process's variance: down to s_down without noise, then s_up of fresh noise."""
    s_up = min(s_next, (s_next**2 * (s**2 - s_next**2) / s**2) ** 0.5)
    return (s_next**2 - s_up**2) ** 0.5, s_up


def photometric(denoised: torch.Tensor, shading: torch.Tensor, o: Observation, weight: torch.Tensor) -> torch.Tensor:
    """L_pho: the weighted sum of squares over the map (paper, equation 1)."""
    return ((weight * (albedo(denoised) * shading - o.texture)) ** 2).sum()


def albedo(denoised: torch.Tensor) -> torch.Tensor:
    """The linear diffuse albedo [3, H, W] of a map [1, 7, H, W]."""
    return (denoised[0, :3] + 1) / 2


def clipped(gradient: torch.Tensor, limit: float) -> torch.Tensor:
    """The gradient with every texel's seven numbers scaled back to at most `limit`, so that one bad texel does not hold up the others."""
    return gradient * (limit / gradient.abs().amax(1, keepdim=True).clamp_min(limit))


def proximal(denoised: torch.Tensor, shading: torch.Tensor, o: Observation, s: float, residual: float) -> torch.Tensor:
    """The map nearest to `denoised` (spread s) that explains the texture (spread `residual`): per texel, in closed form (Zhu et al. 2023)."""
    half = shading / 2 * o.weight
    ratio = (residual / s) ** 2
    wanted = o.texture * o.weight - half
    out = denoised.clone()
    out[0, :3] = (half * wanted + ratio * denoised[0, :3]) / (half * half + ratio)
    return out


def light_loss(lights: Lights, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> torch.Tensor:
    """L_pho + L_neg + 0.1 L_TV of theta. L_TV is the L1 variation of the shading on the ring, which makes M's border seamless."""
    shading = o.shader.total(lights)
    loss = photometric(denoised, shading, o, o.weight * o.trust)
    brightness = (o.weight * albedo(denoised) ** 2).mean()  # L_pho is larger on light skin
    if recipe.even:
        loss = loss + recipe.even * brightness * o.weight.sum() * ((lights.glob * BAND_OF)[:, 1:] ** 2).sum()
    if not o.shader.empty:
        local = o.shader.local(lights)
        loss = loss + recipe.neg * (local.clamp_min(0) ** 2).sum()
        loss = loss + recipe.tv * variation(shading[(slice(None), *o.shader.box)], o.ring[o.shader.box])
        loss = loss + recipe.faint * brightness * (local**2).sum()
        loss = loss + recipe.smooth * brightness / o.texel * variation(local, o.shader.box_alpha)
    return loss


def variation(image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """The weighted L1 norm of forward differences of [3, H, W]; the weight [H, W] is taken at the later texel."""
    return (image.diff(dim=1).abs() * weight[1:]).sum() + (image.diff(dim=2).abs() * weight[:, 1:]).sum()


def update_lights(state: State, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> None:
    """One step of Adam on theta with an exponentially decaying rate."""
    lights = state.lights.requires_grad_(True)
    gradients = torch.autograd.grad(light_loss(lights, denoised, o, recipe), lights.parameters(), allow_unused=True)
    lights.requires_grad_(False)
    if not state.moments:
        state.moments = [torch.zeros_like(p) for p in lights.parameters() for _ in range(2)]
    rate = recipe.light_rate * recipe.light_decay**state.updates
    state.updates += 1
    for k, (parameter, gradient) in enumerate(zip(lights.parameters(), gradients, strict=True)):
        if gradient is None:
            continue
        mean, square = state.moments[2 * k], state.moments[2 * k + 1]
        mean.lerp_(gradient, 1 - BETAS[0])
        square.lerp_(gradient * gradient, 1 - BETAS[1])
        mean_hat, square_hat = mean / (1 - BETAS[0] ** state.updates), square / (1 - BETAS[1] ** state.updates)
        parameter.sub_(rate * mean_hat / (square_hat.sqrt() + 1e-8))


def _factor(s: float, recipe: Recipe, observations: dict[int, Observation]) -> int:
    return next((factor for factor, above in recipe.coarse if s > above and factor in observations), 1)


def _resized(maps: torch.Tensor, height: int, width: int) -> torch.Tensor:
    if maps.shape[-2:] == (height, width):
        return maps
    rows, columns = (interpolation(old, new).to(maps) for old, new in zip(maps.shape[-2:], (height, width), strict=True))
    return rows @ maps @ columns.T


def blurred(image: torch.Tensor, sigma: float = 0.8) -> torch.Tensor:
    """[3, H, W] under a 3 x 3 Gaussian, reflected at the border: the released code compares textures through it."""
    line = torch.exp(-torch.tensor([-1.0, 0.0, 1.0]) ** 2 / (2 * sigma**2))
    line = line / line.sum()
    padded = functional.pad(image[:, None], (1, 1, 1, 1), mode="reflect")
    return functional.conv2d(padded, torch.outer(line, line)[None, None].to(image))[:, 0]
