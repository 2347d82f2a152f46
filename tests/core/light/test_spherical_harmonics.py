# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical harmonics against quadrature, and the sky's light on a ball, whose answer is known."""

import numpy as np
import pytest
import torch
import trimesh

from core.geometry.meshes import Mesh
from core.geometry.raster import RayCaster
from core.light.skylight import ambient_occlusion, radiance_transfer
from core.light.spherical_harmonics import (
    GAMMA_BANDS,
    LAMBERT,
    ORTHONORMAL,
    UNIFORM,
    per_function,
    sh_basis,
    sh_polynomials,
)

pytest.importorskip("torch")


def quadrature(rows: int = 200, columns: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions [N, 3] and their solid angles [N]: Gauss and Legendre's in z, even in azimuth."""
    z, weight = np.polynomial.legendre.leggauss(rows)
    azimuth = (np.arange(columns) + 0.5) * 2 * np.pi / columns
    r = np.sqrt(1 - z**2)[:, None]
    directions = np.stack([r * np.cos(azimuth), r * np.sin(azimuth), np.broadcast_to(z[:, None], (rows, columns))], -1)
    return directions.reshape(-1, 3), np.repeat(weight * 2 * np.pi / columns, columns)


@pytest.mark.parametrize("array", [np.asarray, torch.from_numpy], ids=["numpy", "torch"])
def test_the_functions_are_orthonormal(array):
    directions, solid = quadrature()
    basis = np.asarray(sh_basis(array(directions)))
    assert np.abs((basis.T * solid) @ basis - np.eye(9)).max() < 1e-12
    assert basis[:, 0] @ solid == pytest.approx(4 * np.pi / UNIFORM) and np.allclose(UNIFORM * basis[:, 0], 1)


@pytest.mark.parametrize("array", [np.asarray, torch.from_numpy], ids=["numpy", "torch"])
def test_band_factors_give_a_lambertian_surfaces_irradiance(array):
    """Of radiance that is one function, of the authors' one that is scaled by 1, sqrt 3 and 2 sqrt 2."""
    directions, solid = quadrature()
    normals = np.random.default_rng(0).normal(size=(7, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    irradiance = np.maximum(normals @ directions.T, 0) @ (solid[:, None] * sh_basis(directions))
    assert np.abs(np.asarray(sh_basis(array(normals))) * per_function(LAMBERT) * np.pi - irradiance).max() < 1e-4
    gamma = np.asarray(sh_basis(array(normals), GAMMA_BANDS))
    assert np.abs(gamma / per_function((1, 3**0.5, 2 * 2**0.5)) - irradiance).max() < 1e-4
    scales = np.array(GAMMA_BANDS) / ORTHONORMAL
    assert np.allclose(scales, [np.pi, 2 * np.pi / 3**0.5, np.pi / 2**0.5], rtol=1e-15)


def test_order_and_signs():
    """Condon and Shortley's phase: where x, y and z are positive, the functions of odd m are negative."""
    up, diagonal = sh_basis(np.array([0.0, 0, 1])), sh_basis(np.array([0.8, 0.36, 0.48]))
    assert np.flatnonzero(np.abs(up) > 1e-15).tolist() == [0, 2, 6]
    assert np.sign(diagonal).tolist() == [1, -1, 1, -1, 1, -1, -1, -1, 1]
    assert diagonal[3] / diagonal[1] == pytest.approx(0.8 / 0.36)
    assert sh_polynomials(np.array([0.8, 0.36, 0.48]))[6] == pytest.approx(3 * 0.48**2 - 1)


@pytest.mark.parametrize("bands", [ORTHONORMAL, GAMMA_BANDS])
def test_both_kinds_of_arrays_and_both_axes_agree(bands):
    directions = np.random.default_rng(1).normal(size=(3, 5, 4)).astype(np.float32)  # of any length
    planes = sh_basis(directions, bands, axis=0)
    assert planes.shape == (9, 5, 4) and planes.dtype == np.float32
    assert np.array_equal(np.moveaxis(planes, 0, -1), sh_basis(np.moveaxis(directions, 0, -1), bands))
    tensor = sh_basis(torch.from_numpy(directions), bands, axis=0)
    assert tensor.dtype == torch.float32 and np.allclose(tensor.numpy(), planes, rtol=1e-6, atol=1e-6)


def test_the_transfer_of_an_open_ball_is_lamberts_and_nothing_is_occluded():
    ball = trimesh.creation.icosphere(2, radius=0.1)
    normals = ball.vertices / 0.1
    transfer = radiance_transfer(RayCaster(Mesh(ball.vertices, ball.faces)), ball.vertices, normals, rays=512)
    assert np.allclose(transfer, sh_basis(normals) * per_function(LAMBERT), atol=0.03)
    assert np.allclose(UNIFORM * transfer[:, 0], 1, atol=0.03) and np.allclose(
        ambient_occlusion(transfer), 1, atol=0.03
    )
