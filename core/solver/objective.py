# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""L_pho(A, theta) = ||I_UV - Gamma_theta(A, N_c)||^2, of what is observed and what is sampled (paper, equation 1)."""

from __future__ import annotations

from dataclasses import dataclass, field

import torch
from torch.nn import functional

from .lighting import Lights, OnDevice, Shader


@dataclass(frozen=True)
class Observation(OnDevice):
    """Map as it was observed, at one size.

    texture I_UV [3, H, W], scaled so that its shading is about one; weight [H, W] in [0, 1]: how much a texel's
    observation counts; trust [H, W] in [0, 1]: how much of it light may explain (less for brows, lips and hair); coords
    [1, 2, H, W] for the prior; shader Gamma with N_c and M; ring [H, W]: where L_TV counts; texel: side of a texel in
    texels of a 1024 map; restraint [H, W] in [0, 1], or one number: how much `Recipe.faint` holds the local light back;
    missing [H, W] in [0, 1), or one number: the share of the light that M's border says is missing (border.py), which
    the local light is held to.
    """

    texture: torch.Tensor
    weight: torch.Tensor
    trust: torch.Tensor
    coords: torch.Tensor
    shader: Shader
    ring: torch.Tensor
    texel: float = 1.0
    restraint: torch.Tensor | float = 1.0
    missing: torch.Tensor | float = 0.0


@dataclass
class State(OnDevice):
    r"""State of the sampling before step `step`.

    x: x_t [1, 7, H, W]; denoised: \hat x of the step before, x_0^ref at first; lights: theta; moments: Adam's, of
    theta.
    """

    step: int
    x: torch.Tensor | None
    denoised: torch.Tensor
    lights: Lights
    moments: list[torch.Tensor] = field(default_factory=list)


def albedo(denoised: torch.Tensor) -> torch.Tensor:
    """Return A, the linear diffuse albedo [3, H, W] of a map [1, 7, H, W] in the network's range."""
    return (denoised[0, :3] + 1) / 2


def photometric_loss(
    denoised: torch.Tensor, shading: torch.Tensor, o: Observation, weight: torch.Tensor, blur: bool = False
) -> torch.Tensor:
    """Return L_pho (equation 1) of a map [1, 7, H, W] under a shading [3, H, W], its rendering blurred by `blur`."""
    rendered = albedo(denoised) * shading
    return ((weight * ((blur_maps(rendered) if blur else rendered) - o.texture)) ** 2).sum()


def rms_residual(state: State, observations: dict[int, Observation]) -> float:
    """Return the root mean square of texture minus albedo times shading, linear: for display while the solver runs."""
    o = observation_of(state, observations)
    with torch.no_grad():
        error = (albedo(state.denoised) * o.shader.total(state.lights) - o.texture) ** 2 * o.weight
    return float((error.sum() / (3 * o.weight.sum()).clamp_min(1e-6)).sqrt())


def observation_of(state: State, observations: dict[int, Observation]) -> Observation:
    """Return the observation at the size that the state is sampled at."""
    return next(o for o in observations.values() if o.weight.shape == state.denoised.shape[-2:])


def blur_maps(image: torch.Tensor, sigma: float = 0.8) -> torch.Tensor:
    """Blur [3, H, W] by a 3 x 3 Gaussian, reflected at the border: the released code compares textures through it."""
    line = torch.exp(-(torch.arange(-1.0, 2.0, device=image.device) ** 2) / (2 * sigma**2))
    line = line / line.sum()
    padded = functional.pad(image[:, None], (1, 1, 1, 1), mode="reflect")
    return functional.conv2d(padded, torch.outer(line, line)[None, None])[:, 0]
