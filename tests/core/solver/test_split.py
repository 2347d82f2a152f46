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
from core.solver.extensions.split import (
    COLOUR_AXES,
    Scales,
    Shapes,
    average_cells,
    enlarge_field,
    infer_split,
    join_seen,
    log_probability,
    split_captures,
)
from core.stages.solve.head_cells import make_head_cells

SIZE = 384
TONE = torch.tensor([0.4, 0.25, 0.2])[:, None, None]


@cache
def face():
    """Normals [3, S, S] and the facial skin [S, S] of the built-in head."""
    mesh = template.load()
    index, bary = raster.rasterize_uv(mesh, SIZE)
    normal = raster.bleed(raster.interpolate(vertex_normals(mesh), mesh.faces, index, bary), index >= 0)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    skin = [template.mask(name, 512)[::1] for name in ("skin", "face")]
    small = raster.sample(
        skin[0] * skin[1], np.stack(np.meshgrid(np.arange(SIZE), np.arange(SIZE)), -1).reshape(-1, 2) * 512 / SIZE + 1
    ).reshape(SIZE, SIZE)
    inside = torch.from_numpy((small > 0.9).astype(np.float32))
    return torch.from_numpy(normal.transpose(2, 0, 1).astype(np.float32)), inside


def lamp(seed, amount):
    """Log shading [3, S, S] of a second-order light that varies by `amount` over the face, a little coloured."""
    rng, (normal, skin) = np.random.default_rng(seed), face()
    coefficients = rng.standard_normal(9) * skin_or_light.ORDER_DEVIATIONS
    field = np.tensordot(coefficients, sh_basis(normal.numpy().astype(np.float64), axis=0), 1)
    field *= amount / field[skin.numpy() > 0].std()
    return torch.from_numpy(np.multiply.outer([1.1, 1.0, 0.9], field)).float()


def drawn(seed, scales, parts=("traits",)):
    """Log fields [3, S, S] drawn from the model's own Gaussians, at its cells."""
    normal, skin = face()
    cells = average_cells(
        Shapes(TONE.expand(3, SIZE, SIZE), TONE.expand(3, SIZE, SIZE), normal, skin), make_head_cells(24)
    )
    on_head, count = cells.on_head, len(cells.normal)
    everywhere = skin_or_light.Places(on_head.places, cells.normal, on_head.varied, np.zeros(count, int))
    model = skin_or_light.model_covariances(everywhere, everywhere)
    rng, values = np.random.default_rng(seed), np.zeros((3, count))
    for part in parts:
        lower = np.linalg.cholesky(getattr(model, part) + 1e-6 * np.eye(count))
        drawn = (lower @ rng.standard_normal((count, 3))).T
        values += getattr(scales, part) * skin_or_light.AXIS_DEVIATIONS[:, None] * drawn
    return enlarge_field(torch.from_numpy(skin_or_light._spread(COLOUR_AXES.T @ values, on_head)), SIZE)


def shapes(log, weight=1.0):
    normal, skin = face()
    return Shapes(TONE * log.exp(), TONE.expand(3, SIZE, SIZE), normal, skin * weight)


def deviation(log):
    inside = log[:, face()[1] > 0]
    return float((inside - inside.mean(1, keepdim=True)).std())


def test_a_lamp_on_even_skin_is_light_in_strength_and_shape():
    for seed in range(2):
        light = lamp(seed, 0.2)
        found = split_captures([shapes(light)], make_head_cells)
        assert deviation(found.light(face()[0]).log() - light) < 0.02
        assert found.scales.light > found.scales.traits


def test_traits_alone_are_mostly_left_to_the_skin():
    scales = Scales(0.2, 0.08, 0.08, 0.07)
    taken = [
        deviation(split_captures([shapes(traits)], make_head_cells).light(face()[0]).log()) / deviation(traits)
        for traits in (drawn(seed, scales) for seed in range(3))
    ]
    assert np.mean(taken) < 0.4, taken


def test_a_lamp_on_a_face_with_traits_is_told_from_them_better_than_by_least_squares():
    normal, skin = face()
    basis = sh_basis(normal.numpy().astype(np.float64), axis=0)[:, skin.numpy() > 0]
    ours, squares = [], []
    for seed in range(3):
        light = lamp(seed, 0.08)
        mixed = light + drawn(10 + seed, Scales(0.25, 0.08, 0.08, 0.07))
        ours.append(deviation(split_captures([shapes(mixed)], make_head_cells).light(normal).log() - light))
        inside, true = mixed[:, skin > 0].numpy(), light[:, skin > 0].numpy()
        fitted = inside @ np.linalg.pinv(basis) @ basis
        squares.append(float((fitted - true - (fitted - true).mean(1, keepdims=True)).std()))
    assert np.mean(ours) < 0.8 * np.mean(squares), (ours, squares)


def test_exposure_and_the_axes_of_the_world_change_nothing():
    mixed, normal = lamp(0, 0.1) + drawn(5, Scales(0.2, 0.08, 0.08, 0.07)), face()[0]
    before = split_captures([shapes(mixed)], make_head_cells)
    brighter = split_captures([shapes(mixed + 0.3)], make_head_cells)
    assert deviation(before.light(normal).log() - brighter.light(normal).log()) < 0.005
    rotation = torch.from_numpy(np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]).float()
    turned = torch.einsum("ij,jhw->ihw", rotation * torch.linalg.det(rotation), normal)
    there = split_captures([Shapes(TONE * mixed.exp(), TONE.expand(3, SIZE, SIZE), turned, face()[1])], make_head_cells)
    assert deviation(before.light(normal).log() - there.light(turned).log()) < 0.01


def test_the_probability_is_the_gaussians():
    cells = average_cells(shapes(lamp(1, 0.1)), make_head_cells(12))
    seen, values = join_seen([cells])
    together = skin_or_light.model_covariances(seen, seen)
    scales = skin_or_light.TYPICAL_SCALES
    by_scipy = 0
    for axis in range(3):
        normal = multivariate_normal(cov=together.covariance(scales, axis), allow_singular=True)
        by_scipy += normal.logpdf(values[:, axis])
    constant = -1.5 * len(values) * np.log(2 * np.pi)
    assert log_probability(together, values, scales) + constant == pytest.approx(by_scipy, rel=1e-6)


def test_of_two_captures_what_differs_is_light_and_what_agrees_is_skin():
    scales, (normal, skin) = Scales(0.25, 0.1, 0.15, 0.03), face()
    traits, local = drawn(3, scales), drawn(4, scales, ("local",))
    lights = lamp(1, 0.15), lamp(2, 0.15)
    first, second = shapes(traits + lights[0] + local), shapes(traits + lights[1])
    alone, both = split_captures([first], make_head_cells), split_captures([first, second], make_head_cells)
    alone_left = deviation(lights[0] + local - alone.light(normal).log())
    assert (
        deviation(lights[0] + local - both.light(normal).log() - enlarge_field(torch.from_numpy(both.local), SIZE))
        < 0.7 * alone_left
    )
    told = enlarge_field(torch.from_numpy(both.local), SIZE).mean(0)[skin > 0]
    assert np.corrcoef(told.numpy(), local.mean(0)[skin > 0].numpy())[0, 1] > 0.75


def test_little_seen_tells_little_of_the_light():
    normal, skin = face()
    nothing = split_captures(
        [Shapes(TONE.expand(3, SIZE, SIZE), TONE.expand(3, SIZE, SIZE), normal, 0 * skin)], make_head_cells
    )
    assert deviation(nothing.light(normal).log()) < 1e-6
    corner = torch.zeros_like(skin)
    corner[160:180, 180:200] = 1
    cells = average_cells(shapes(lamp(0, 0.2), corner), make_head_cells(48))
    assert deviation(infer_split([cells], skin_or_light.TYPICAL_SCALES).light(normal).log()) < 0.2
