# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked light whose answer is known: a sun over a plane and over a plane with a sphere above it."""

from dataclasses import replace

import numpy as np
import trimesh

from core.face import template
from core.geometry import raster
from core.geometry.meshes import Mesh
from core.light.spherical_harmonics import UNIFORM
from research.people import light

WHITE_SKY = np.zeros((9, 3))
WHITE_SKY[0] = UNIFORM


def floor(half: float = 0.1, sphere: float | None = None) -> Mesh:
    """A square floor facing +Z that fills the UV square, if wanted below a sphere of that height, whose UVs lie in one
    point."""
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half
    faces, uvs = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 0], [1, 0], [1, 1], [0, 1], [-1, -1]], float)
    face_uvs = faces
    if sphere:
        ball = trimesh.creation.icosphere(4, radius=half / 4)
        vertices = np.concatenate([vertices, ball.vertices + [0, 0, sphere]])
        faces = np.concatenate([faces, ball.faces + 4])
        face_uvs = np.concatenate([face_uvs, np.full_like(ball.faces, 4)])
    return Mesh(vertices, faces, uvs, face_uvs)


def test_the_sun_on_a_floor_follows_the_cosine_and_casts_no_shadow():
    rng, sun = np.random.default_rng(0), np.array([0.6, 0, 0.8])
    shading, shadow, normals = light.bake(
        floor(), 64, light.SkyAndSun(0 * WHITE_SKY, sun, np.array([1.0, 0.5, 0.25]), 0.01), "self", rng
    )
    assert np.allclose(shading, 0.8 * np.array([1.0, 0.5, 0.25]) + 0.005, atol=1e-3)
    assert shadow.max() == 0 and np.allclose(normals, [0, 0, 1])


def test_a_sphere_shades_a_disc_of_its_size_where_the_sun_says_so():
    rng, sun = np.random.default_rng(0), np.array([0.6, 0, 0.8])
    size, half, height = 128, 0.1, 0.08
    _, shadow, _ = light.bake(
        floor(half, height), size, light.SkyAndSun(WHITE_SKY, sun, np.ones(3), 0.002), "self", rng
    )
    row, column = np.nonzero(shadow > 0.5)
    x, y = ((column + 0.5) / size * 2 - 1) * half, (1 - (row + 0.5) / size * 2) * half
    assert abs(x.mean() + height * 0.6 / 0.8) < 0.002 and abs(y.mean()) < 0.002
    area = len(row) * (2 * half / size) ** 2
    assert np.isclose(area, np.pi * (half / 4) ** 2 / 0.8, rtol=0.05)  # the disc seen obliquely


def test_a_heads_light_is_the_sky_s_and_what_is_left_of_the_sun_s():
    rng = np.random.default_rng([3, 7])
    drawn, inside = light.random_light(rng), raster.rasterize_uv(template.load(), 128)[0] >= 0
    shading, shadow, normal = light.bake(template.load(), 128, drawn, "leaves", rng)
    assert 0.02 < (shadow[inside] > 0.5).mean() < 0.9 and 0 <= shadow.min() and shadow.max() <= 1
    # where nothing blocks the sun, shading is the sky's and the whole sun's; where all is blocked, it is darker than
    # that by the sun's share
    cosine = np.maximum(normal @ drawn.sun, 0)[..., None] * drawn.colour
    lit = inside & (cosine[..., 0] > 0.1)
    assert (shading - cosine * (1 - shadow[..., None]))[lit].min() > -1e-4
    without = replace(drawn, colour=0 * drawn.colour)
    assert light.bake(template.load(), 128, without, "none", rng)[1].max() == 0
