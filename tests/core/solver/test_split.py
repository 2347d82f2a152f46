# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin or light: what was laid into a texture is found again, light as light and traits as traits."""

from functools import cache

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal

from core.face import template
from core.geometry import raster
from core.geometry.meshes import vertex_normals
from core.light.spherical_harmonics import sh_basis
from core.solver.extensions import split as skin_or_light
from core.solver.extensions.split import COLOUR_AXES, Scales, Shapes, average_cells, enlarge_field, split_captures
from core.stages.solve.head_cells import make_head_cells

SIZE = 384
TONE = torch.tensor([0.4, 0.25, 0.2])[:, None, None].expand(3, SIZE, SIZE)
USUAL = Scales(0.2, 0.08, 0.08, 0.07)


@cache
def face():
    """Normals [3, S, S] and the facial skin [S, S] of the built-in head."""
    mesh = template.load()
    index, bary = raster.rasterize_uv(mesh, SIZE)
    normal = raster.bleed(raster.interpolate(vertex_normals(mesh), mesh.faces, index, bary), index >= 0)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    inside = template.mask("skin", SIZE) * template.mask("face", SIZE) > 0.9
    return torch.from_numpy(normal.transpose(2, 0, 1).astype(np.float32)), torch.from_numpy(inside).float()


def lamp(seed, amount):
    """Log shading [3, S, S] of a second-order light that varies by `amount` over the face, a little coloured."""
    normal, skin = face()
    coefficients = np.random.default_rng(seed).standard_normal(9) * skin_or_light.ORDER_DEVIATIONS
    field = np.tensordot(coefficients, sh_basis(normal.numpy().astype(np.float64), axis=0), 1)
    field *= amount / field[skin.numpy() > 0].std()
    return torch.from_numpy(np.multiply.outer([1.1, 1.0, 0.9], field)).float()


@cache
def model():
    """The head's cells and the covariances of all of them with each other."""
    cells = average_cells(shapes(0 * TONE), make_head_cells(24))
    on_head, count = cells.on_head, len(cells.normal)
    everywhere = skin_or_light.Places(on_head.places, cells.normal, on_head.varied, np.zeros(count, int))
    return on_head, skin_or_light.model_covariances(everywhere, everywhere)


@cache
def drawn(seed, scales, part="traits"):
    """Log fields [3, S, S] drawn from one of the model's own Gaussians, at its cells."""
    on_head, covariances = model()
    covariance = getattr(covariances, part)
    lower = np.linalg.cholesky(covariance + 1e-6 * np.eye(len(covariance)))
    white = (lower @ np.random.default_rng(seed).standard_normal((len(covariance), 3))).T
    values = getattr(scales, part) * skin_or_light.AXIS_DEVIATIONS[:, None] * white
    return enlarge_field(torch.from_numpy(skin_or_light._spread(COLOUR_AXES.T @ values, on_head)), SIZE)


def shapes(log, weight=1.0):
    normal, skin = face()
    return Shapes(TONE * log.exp(), TONE, normal, skin * weight)


def split(*captures):
    return split_captures(list(captures), make_head_cells)


def deviation(log):
    inside = log[:, face()[1] > 0]
    return float((inside - inside.mean(1, keepdim=True)).std())


def test_a_lamp_on_even_skin_is_light_in_strength_and_shape():
    light = lamp(0, 0.2)
    found = split(shapes(light))
    assert deviation(found.light(face()[0]).log() - light) < 0.02
    assert found.scales.light > found.scales.traits


def test_traits_alone_are_mostly_left_to_the_skin():
    traits = drawn(0, USUAL)
    assert deviation(split(shapes(traits)).light(face()[0]).log()) < 0.4 * deviation(traits)


def test_a_lamp_on_a_face_with_traits_is_told_from_them_better_than_by_least_squares():
    normal, skin = face()
    basis = sh_basis(normal.numpy().astype(np.float64), axis=0)[:, skin.numpy() > 0]
    ours, squares = [], []
    for seed in range(2):
        light = lamp(seed, 0.08)
        mixed = light + drawn(10 + seed, Scales(0.25, 0.08, 0.08, 0.07))
        ours.append(deviation(split(shapes(mixed)).light(normal).log() - light))
        inside, true = mixed[:, skin > 0].numpy(), light[:, skin > 0].numpy()
        off = inside @ np.linalg.pinv(basis) @ basis - true
        squares.append(float((off - off.mean(1, keepdims=True)).std()))
    assert np.mean(ours) < 0.8 * np.mean(squares), (ours, squares)


def test_exposure_and_the_axes_of_the_world_change_nothing():
    mixed, (normal, skin) = lamp(0, 0.1) + drawn(1, USUAL), face()
    rotation = torch.from_numpy(np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]).float()
    turned = torch.einsum("ij,jhw->ihw", rotation * torch.linalg.det(rotation), normal)
    before = split(shapes(mixed)).light(normal).log()
    there = split(Shapes(TONE * (mixed + 0.3).exp(), TONE, turned, skin)).light(turned).log()
    assert deviation(before - there) < 0.01


def test_the_probability_is_the_gaussians():
    seen, values = skin_or_light.join_seen([average_cells(shapes(lamp(1, 0.1)), make_head_cells(12))])
    together, scales = skin_or_light.model_covariances(seen, seen), skin_or_light.TYPICAL_SCALES
    normals = [multivariate_normal(cov=together.covariance(scales, axis), allow_singular=True) for axis in range(3)]
    by_scipy = sum(normal.logpdf(values[:, axis]) for axis, normal in enumerate(normals))
    constant = -1.5 * len(values) * np.log(2 * np.pi)
    assert skin_or_light.log_probability(together, values, scales) + constant == pytest.approx(by_scipy, rel=1e-6)


def test_of_two_captures_what_differs_is_light_and_what_agrees_is_skin():
    scales, (normal, skin) = Scales(0.25, 0.1, 0.15, 0.03), face()
    traits, local, light = drawn(3, scales), drawn(4, scales, "local"), lamp(1, 0.15)
    first, second = shapes(traits + light + local), shapes(traits + lamp(2, 0.15))
    alone, both = split(first), split(first, second)
    told = enlarge_field(torch.from_numpy(both.local), SIZE)
    left_alone, left = light + local - alone.light(normal).log(), light + local - both.light(normal).log() - told
    assert deviation(left) < 0.7 * deviation(left_alone)
    inside = skin > 0
    assert np.corrcoef(told.mean(0)[inside].numpy(), local.mean(0)[inside].numpy())[0, 1] > 0.75


def test_little_seen_tells_little_of_the_light():
    normal, skin = face()
    assert deviation(split(shapes(0 * TONE, 0.0)).light(normal).log()) < 1e-6
    corner = torch.zeros_like(skin)
    corner[160:180, 180:200] = 1
    cells = average_cells(shapes(lamp(0, 0.2), corner), make_head_cells(48))
    assert deviation(skin_or_light.infer_split([cells], skin_or_light.TYPICAL_SCALES).light(normal).log()) < 0.2
