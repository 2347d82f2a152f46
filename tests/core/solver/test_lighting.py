# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical harmonic shading against quadrature, the grid's interpolation, the closed-form global light, and what a local
light costs."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

from core.solver.lighting import Lights, Shader, constant_light, fit_global, interpolation_matrix, shading_basis
from core.solver.lights import light_loss
from core.solver.objective import Observation
from core.solver.recipes import OURS


def sphere(rows: int = 100, columns: int = 200):
    """Directions [3, rows, columns] and solid angles [rows, columns] of a quadrature over the sphere."""
    z, weight = np.polynomial.legendre.leggauss(rows)
    phi = (np.arange(columns) + 0.5) * 2 * np.pi / columns
    r = np.sqrt(1 - z**2)[:, None]
    direction = np.stack([r * np.cos(phi), r * np.sin(phi), np.broadcast_to(z[:, None], (rows, columns))])
    solid_angle = np.broadcast_to(weight[:, None] * 2 * np.pi / columns, (rows, columns))
    return torch.from_numpy(direction), torch.from_numpy(solid_angle.copy())


def test_basis_is_orthogonal_with_the_stated_band_scales():
    directions, solid = sphere()
    basis = shading_basis(directions).reshape(9, -1)
    gram = (basis * solid.reshape(-1)) @ basis.T
    lambert = [np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5
    scale = [1] + [3**0.5] * 3 + [2 * 2**0.5] * 5
    expected = np.diag((np.array(lambert) * scale) ** 2)  # orthonormal y_lm times these factors
    assert np.abs(gram.numpy() - expected).max() < 1e-6


def test_shading_is_the_cosine_integral_of_the_radiance():
    directions, solid = sphere()
    basis = shading_basis(directions)
    factor = torch.tensor([np.pi] + [2 * np.pi / 3 * 3**0.5] * 3 + [np.pi / 4 * 2 * 2**0.5] * 5)
    y = basis / factor[:, None, None]  # orthonormal
    rng = np.random.default_rng(0)
    coefficients = torch.from_numpy(rng.normal(size=9))
    radiance = (coefficients[:, None, None] * y).sum(0)
    normals = torch.nn.functional.normalize(torch.from_numpy(rng.normal(size=(3, 5))), dim=0)
    irradiance = torch.einsum("cn,chw->nhw", normals, directions).clamp_min(0)
    irradiance = (irradiance * radiance * solid).sum((1, 2))
    gamma = coefficients / torch.tensor([1] + [3**0.5] * 3 + [2 * 2**0.5] * 5)
    assert torch.allclose((gamma[:, None] * shading_basis(normals)).sum(0), irradiance, atol=1e-3)


def test_constant_light_shades_a_sphere_evenly():
    directions, _ = sphere(20, 40)
    shader, colour = Shader(directions.float(), torch.zeros(20, 40), (2, 2)), torch.tensor([0.5, 1.0, 2.0])
    lights = Lights(constant_light(colour), torch.zeros(3, 9, 2, 2), torch.ones(3))
    assert torch.allclose(shader.total(lights), colour[:, None, None].expand(3, 20, 40), atol=1e-6)


@pytest.mark.parametrize("coloured", [True, False])
def test_local_light_lives_inside_the_mask_only(coloured):
    directions, _ = sphere(40, 40)
    alpha = torch.zeros(40, 40)
    alpha[10:20, 12:30] = 0.7
    shader = Shader(directions.float(), alpha, (5, 5))
    generator = torch.Generator().manual_seed(0)
    lights = Lights(
        torch.randn(3, 9, generator=generator),
        torch.randn(1 if coloured else 3, 9, 5, 5, generator=generator),
        torch.rand(3, generator=generator),
    )
    difference = shader.total(lights) - shader.main(lights)
    assert difference[:, alpha == 0].abs().max() == 0
    assert difference[:, alpha > 0].abs().mean() > 0.1
    # the definition, texel by texel: gamma = gamma^g + interp(V) M
    rows, columns = interpolation_matrix(5, 40), interpolation_matrix(5, 40)
    grid = rows @ lights.grid @ columns.T * (lights.chroma[:, None, None, None] if coloured else 1)
    gamma = lights.glob[:, :, None, None] + grid * alpha
    assert torch.allclose((gamma * shader.basis).sum(1), shader.total(lights), atol=1e-4)


def test_interpolation_keeps_constants_and_lines():
    for cells, texels in ((12, 96), (7, 100), (1, 24), (96, 24), (5, 5)):
        matrix = interpolation_matrix(cells, texels)
        assert torch.allclose(matrix.sum(1), torch.ones(texels), atol=1e-6)
    line = interpolation_matrix(20, 160) @ torch.arange(20.0)
    assert torch.allclose(line[24:-24], (torch.arange(160.0)[24:-24] + 0.5) / 8 - 0.5, atol=1e-4)
    assert torch.equal(interpolation_matrix(6, 6), torch.eye(6))


def test_global_light_is_found_in_closed_form():
    directions, _ = sphere(48, 48)
    basis = shading_basis(directions.float())
    generator = torch.Generator().manual_seed(1)
    gamma = constant_light(torch.ones(3)) + 0.1 * torch.randn(3, 9, generator=generator)
    albedo = 0.2 + 0.5 * torch.rand(3, 48, 48, generator=generator)
    weight = torch.ones(48, 48)
    texture = albedo * torch.einsum("ck,khw->chw", gamma, basis)
    texture[:, :10], weight[:10] = 9.0, 0.0  # what is masked must not matter
    assert torch.allclose(fit_global(texture, albedo, basis, weight, ridge=1e-9), gamma, atol=1e-4)


SIZE = 24
MISSING = 0.2
RECIPE = replace(OURS, faint=1.4)


@dataclass
class Drawn:
    """A shader whose lights are the pictures themselves: a warm main light and what the grid takes of it under M."""

    taken: torch.Tensor
    box_alpha: torch.Tensor
    empty: bool = False
    box: tuple = (slice(None), slice(None))

    def main(self, lights):
        return torch.tensor([1.2, 1.0, 0.7])[:, None, None].expand(3, SIZE, SIZE)

    def local(self, lights):
        return self.taken * self.box_alpha

    def unmodulated(self, lights):
        return self.taken

    def total(self, lights):
        return self.main(lights) + self.local(lights)


def cost(taken: torch.Tensor, tone: float, shadow: float = 0.0, **recipe) -> float:
    """The loss of a grid that takes so much light from an even skin, filmed with `shadow` of the light missing in M."""
    mask = torch.zeros(SIZE, SIZE)
    mask[6:18, 6:18] = 1
    ring = torch.zeros(SIZE, SIZE)
    ring[4:20, 4:20] = 1
    ring[8:16, 8:16] = 0
    shader = Drawn(taken, mask)
    denoised = torch.full((1, 7, SIZE, SIZE), 2 * tone - 1)
    texture = tone * shader.main(None) * (1 - shadow * mask)
    o = Observation(
        texture, torch.ones(SIZE, SIZE), torch.ones(SIZE, SIZE), torch.zeros(1), shader, ring, missing=MISSING
    )
    return float(light_loss(None, denoised, o, replace(RECIPE, **recipe)))


def test_every_term_weighs_as_much_beside_the_data_on_dark_skin_as_on_light():
    grid = 0.1 * torch.randn(3, SIZE, SIZE, generator=torch.Generator().manual_seed(0)) - 0.6
    light, dark = (cost(grid, tone, shadow=0.5) / tone**2 for tone in (0.45, 0.03))
    assert dark == pytest.approx(light, rel=1e-4)


def test_light_is_drawn_to_a_share_of_the_main_light_in_each_colour():
    main = torch.tensor([1.2, 1.0, 0.7])[:, None, None].expand(3, SIZE, SIZE)
    alone = {"seam": 0.0, "smooth": 0.0}
    assert cost(-MISSING * main, 0.3, shadow=MISSING, **alone) == pytest.approx(0, abs=1e-9)
    grey = torch.full((3, SIZE, SIZE), -MISSING)
    assert cost(grey, 0.3, shadow=MISSING, **alone) > 0.01
