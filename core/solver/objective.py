# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sampler is given and where it stands: the observation, the state, and the rendering equation between them
(paper, equations 1 to 4)."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import torch
from torch.nn import functional

from .lighting import Lights, Shader


@dataclass(frozen=True)
class Observation:
    """What is known of the map at one size.

    texture I_UV [3, H, W], scaled so that its shading is about one; weight [H, W] in [0, 1]: how far a texel's
    observation counts; trust [H, W] in [0, 1]: how far what is seen there may be explained as light (less for brows,
    lips and hair); coords [1, 2, H, W] for the prior; shader Gamma with N_c and M; ring [H, W]: where L_TV counts;
    texel: side of a texel in texels of a 1024 map; restraint [H, W] in [0, 1], or one number: how far `Recipe.faint`
    holds the local light back there; missing [H, W] in [0, 1), or one number: the share of the light that M's border
    says is missing (border.py), which is what it is held to.
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

    def to(self, device: torch.device | str) -> Observation:
        """The same observation on another device."""
        return replace(
            self,
            **{
                f.name: value.to(device)
                for f in fields(self)
                if isinstance(value := getattr(self, f.name), torch.Tensor | Shader)
            },
        )


@dataclass
class State:
    """Where the sampling stands before step `step`. x [1, 7, H, W] is x_t; denoised is \\hat x of the step before
    (first: x_0^ref); moments are Adam's."""

    step: int
    x: torch.Tensor | None
    denoised: torch.Tensor
    lights: Lights
    moments: list[torch.Tensor] = field(default_factory=list)

    def to(self, device: torch.device | str) -> State:
        """The same state on another device."""
        x = None if self.x is None else self.x.to(device)
        return State(
            self.step,
            x,
            self.denoised.to(device),
            self.lights.to(device),
            [moment.to(device) for moment in self.moments],
        )


def albedo(denoised: torch.Tensor) -> torch.Tensor:
    """The linear diffuse albedo [3, H, W] of a map [1, 7, H, W]."""
    return (denoised[0, :3] + 1) / 2


def photometric_loss(
    denoised: torch.Tensor, shading: torch.Tensor, o: Observation, weight: torch.Tensor, blur: bool = False
) -> torch.Tensor:
    """L_pho: the weighted sum of squares over the map (paper, equation 1).

    Parameters
    ----------
    denoised : [1, 7, H, W] in the network's range; its albedo is taken
    shading : [3, H, W], linear
    o : holds the texture [3, H, W], linear
    weight : [H, W] in [0, 1]
    blur : puts the rendering through a small Gaussian
    """
    rendered = albedo(denoised) * shading
    return ((weight * ((blur_maps(rendered) if blur else rendered) - o.texture)) ** 2).sum()


def rms_residual(state: State, observations: dict[int, Observation]) -> float:
    """Root mean square of texture minus albedo times shading, linear, where the texture counts: what a person watches
    fall while the solver runs."""
    o = next(o for o in observations.values() if o.weight.shape == state.denoised.shape[-2:])
    with torch.no_grad():
        error = (albedo(state.denoised) * o.shader.total(state.lights) - o.texture) ** 2 * o.weight
    return float((error.sum() / (3 * o.weight.sum()).clamp_min(1e-6)).sqrt())


def blur_maps(image: torch.Tensor, sigma: float = 0.8) -> torch.Tensor:
    """[3, H, W] under a 3 x 3 Gaussian, reflected at the border: the released code compares textures through it."""
    line = torch.exp(-(torch.arange(-1.0, 2.0, device=image.device) ** 2) / (2 * sigma**2))
    line = line / line.sum()
    padded = functional.pad(image[:, None], (1, 1, 1, 1), mode="reflect")
    return functional.conv2d(padded, torch.outer(line, line)[None, None])[:, 0]
