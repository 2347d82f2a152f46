# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light models of other methods, of our own writing, behind the solver's contract: only the light differs.

A light model is a shader with `main` and `total` (shading [3, H, W] of its lights), the lights' parameters, and their
loss. Regions (DeFace, Huang et al.): the face is divided softly into K regions, learned with one SH light each.
Environment (FLARE, Bharadwaj et al. 2023; split sum after Munkberg et al. 2022): one diffuse cubemap of free texels for
the whole face. Both know the shadow mask no more than those methods do.
"""

from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import torch
from scipy.cluster.vq import kmeans2
from scipy.spatial import cKDTree
from torch.nn import functional

from core.solver.lighting import Lights, shading_basis
from core.solver.lights import update_lights
from core.solver.objective import Observation, albedo, photometric_loss
from core.solver.recipes import Recipe
from core.solver.start import Start

CELLS = 64  # of a region's outline, over the map's side
SURE = 3.0  # logit of a texel's first region: others begin with a twentieth of it
FACE = 16  # texels of the cubemap along an edge
RATE = 0.03  # of Adam on the logarithm of the cubemap's radiance
ROUGH = 0.02  # weight of its squared differences, per seen texel, pair and mean squared albedo


@dataclass
class RegionLights(Lights):
    """Lights: glob [3, 9] of all regions; grid [K, 3, 9] of each; chroma [K, CELLS, CELLS], logits of regions."""


class RegionShader:
    """Shading by K soft regions: sum over k of softmax(logits)_k (gamma^g + gamma_k) . basis(N_c)."""

    def __init__(self, normal: torch.Tensor):
        self.basis = shading_basis(normal)  # [9, H, W]

    def main(self, lights: Lights) -> torch.Tensor:
        """Shading by what all regions share [3, H, W]."""
        return torch.einsum("ck,khw->chw", lights.glob, self.basis)

    def own(self, lights: Lights) -> torch.Tensor:
        """Shading by what the regions add [3, H, W]."""
        chroma = functional.interpolate(lights.chroma[None], self.basis.shape[1:], mode="bilinear", align_corners=False)
        share = chroma[0].softmax(0)
        return sum(
            weight * torch.einsum("ck,khw->chw", gamma, self.basis)
            for weight, gamma in zip(share, lights.grid, strict=True)
        )

    def total(self, lights: Lights) -> torch.Tensor:
        """Shading [3, H, W]."""
        return self.main(lights) + self.own(lights)


def light_by_regions(start: Start, recipe: Recipe, count: int, seed: int = 0):
    """Replace the grid by soft regions with a light each, which begin as clusters of place and lightness.

    Returns the start, the recipe, and the function that moves the lights.
    """
    observations = {
        factor: replace(o, shader=RegionShader(o.shader.normal)) for factor, o in start.observations.items()
    }
    lights = RegionLights(start.state.lights.glob.clone(), torch.zeros(count, 3, 9), _clusters(start, count, seed))
    return _under(start, observations, lights), recipe, partial(update_lights, loss=_region_loss)


def _region_loss(lights: RegionLights, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> torch.Tensor:
    """Return L_pho with the recipe's pull of the regions' own light towards none."""
    own = o.shader.own(lights)
    loss = photometric_loss(denoised, o.shader.main(lights) + own, o, o.weight * o.trust)
    brightness = (o.weight * albedo(denoised) ** 2).mean()
    return loss + brightness * recipe.faint * (o.weight * own**2).sum()


def _clusters(start: Start, count: int, seed: int) -> torch.Tensor:
    """Return logits [count, CELLS, CELLS] of k-means over cells by place and log(texture / first rendering)."""
    o = start.observations[1]
    rendered = albedo(start.reference) * o.shader.main(start.state.lights)
    ratio = (o.texture.clamp_min(1e-3) / rendered.clamp_min(1e-3)).log().mean(0).clamp(-2, 2)
    ratio, weight = (
        functional.interpolate(a[None, None], (CELLS, CELLS), mode="area")[0, 0].numpy()
        for a in (ratio * o.weight, o.weight)
    )
    row, column = (np.mgrid[:CELLS, :CELLS] + 0.5) / CELLS
    features = np.stack([3 * row, 3 * column, ratio / np.maximum(weight, 0.05)], -1)[weight > 0.5]
    centres, _ = kmeans2(features, count, seed=seed, minit="++")
    everywhere = np.stack([3 * row, 3 * column, ratio / np.maximum(weight, 0.05)], -1)[..., None, :]
    nearest = ((everywhere - centres) ** 2).sum(-1).argmin(-1)
    return SURE * functional.one_hot(torch.from_numpy(nearest), count).permute(2, 0, 1).float()


@dataclass
class EnvironmentLights(Lights):
    """Lights: glob [6 FACE^2, 3], the logarithm of the cubemap's radiance; grid and chroma are not used."""


class EnvironmentShader:
    """Shading by a cubemap of irradiance, which the normals read linearly."""

    def __init__(self, normal: torch.Tensor):
        directions, self.lobe, self.neighbours = cubemap()
        self.shape = normal.shape[1:]
        near, which = _tree().query(normal.reshape(3, -1).T.numpy(), 4)
        weight = 1 / np.maximum(near, 1e-6)
        self.which = torch.from_numpy(which)
        self.weight = torch.from_numpy((weight / weight.sum(1, keepdims=True)).astype(np.float32))

    def main(self, lights: Lights) -> torch.Tensor:
        """Shading [3, H, W]."""
        irradiance = self.lobe @ lights.glob.exp()
        summed = functional.embedding_bag(self.which, irradiance, per_sample_weights=self.weight, mode="sum")
        return summed.T.reshape(3, *self.shape)

    total = main


def light_by_environment(start: Start, recipe: Recipe):
    """Return `start` under one even environment cubemap, the recipe, and the function that moves it."""
    observations = {
        factor: replace(o, shader=EnvironmentShader(o.shader.normal)) for factor, o in start.observations.items()
    }
    o = start.observations[1]
    shade = (o.texture * o.weight).sum((1, 2)) / (albedo(start.reference) * o.weight).sum((1, 2)).clamp_min(1e-6)
    lights = EnvironmentLights(shade.log().repeat(6 * FACE**2, 1), torch.zeros(1), torch.zeros(1))
    phases = tuple(("main", *when) for _, *when in recipe.phases)
    return (
        _under(start, observations, lights),
        replace(recipe, rate=RATE, phases=phases),
        partial(update_lights, loss=_environment_loss),
    )


def _environment_loss(
    lights: EnvironmentLights, denoised: torch.Tensor, o: Observation, recipe: Recipe
) -> torch.Tensor:
    """Return L_pho plus the roughness of the cubemap's logarithm."""
    one, other = o.shader.neighbours.T
    rough = ((lights.glob[one] - lights.glob[other]) ** 2).mean()
    brightness = (o.weight * albedo(denoised) ** 2).mean()
    fit = photometric_loss(denoised, o.shader.main(lights), o, o.weight * o.trust)
    return fit + ROUGH * brightness * o.weight.sum() * rough


@cache
def cubemap() -> tuple[np.ndarray, torch.Tensor, torch.Tensor]:
    """Return a cubemap's unit directions [N, 3], the matrix [N, N] to irradiance over pi, and neighbours [P, 2].

    N = 6 FACE^2; the matrix' rows sum to one; neighbours are also those across edges.
    """
    across = (np.arange(FACE) + 0.5) / FACE * 2 - 1
    u, v = (a.ravel() for a in np.meshgrid(across, across))
    one = np.ones_like(u)
    corners = [
        np.stack(face, -1)
        for face in ((one, v, -u), (-one, v, u), (u, one, -v), (u, -one, v), (u, v, one), (-u, v, -one))
    ]
    points = np.concatenate(corners)
    solid = np.linalg.norm(points, axis=1) ** -3  # solid angle of a texel, but for a constant
    directions = points / np.linalg.norm(points, axis=1, keepdims=True)
    lobe = np.maximum(directions @ directions.T, 0) * solid
    pairs = cKDTree(directions).query_pairs(2.4 / FACE, output_type="ndarray")
    return directions, torch.from_numpy((lobe / lobe.sum(1, keepdims=True)).astype(np.float32)), torch.from_numpy(pairs)


@cache
def _tree() -> cKDTree:
    return cKDTree(cubemap()[0])


def _under(start: Start, observations: dict[int, Observation], lights: Lights) -> Start:
    return replace(start, observations=observations, state=replace(start.state, lights=lights, moments=[]))
