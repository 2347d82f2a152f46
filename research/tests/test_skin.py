# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The procedural skin: what its colours, marks and normals must be."""

from dataclasses import replace

import numpy as np
import pytest

from core.face import template
from core.geometry.meshes import Mesh
from research.people import pigment
from research.people.canvas import canvas, make_canvas, relief_normals
from research.people.skin import GROUND, SkinParameters, make_skin, paint_skin, sample_parameters

SIZE = 256
PLAIN = SkinParameters(melanin=0.04, freckles=0.5, moles=40, age=60)


@pytest.fixture(scope="module")
def plain():
    return make_skin(PLAIN, SIZE)


def test_melanin_darkens_every_channel_and_blood_green_before_red():
    rgb = pigment.reflectance(np.geomspace(0.005, 0.6, 60), np.full(60, 0.015))
    assert (np.diff(rgb, axis=0) < 0).all() and (np.diff(pigment.typology_angle(rgb)) < 0).all()
    assert 0.02 < rgb.min(-1)[0] and rgb[0, 0] > 0.6 and rgb[-1].max() < 0.1  # very light ... very dark
    pale, flushed = pigment.reflectance(np.full(2, 0.02), np.array([0.005, 0.05]))
    assert (flushed < pale).all() and flushed[1] / pale[1] < 0.75 * flushed[0] / pale[0]
    assert np.allclose(pigment._integrate(np.full((1, 31), 0.5)), 0.5, atol=1e-6)  # white paint is white


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(plain):
    again = make_skin(PLAIN, SIZE)
    for name in ("diffuse", "specular", "height", "normal"):
        assert getattr(plain, name).tobytes() == getattr(again, name).tobytes(), name
    assert not np.allclose(make_skin(replace(PLAIN, tone_seed=1), SIZE).diffuse, plain.diffuse, atol=0.01)


def test_a_mole_seed_moves_moles_and_nothing_else(plain):
    other, without = make_skin(replace(PLAIN, mole_seed=9), SIZE), make_skin(replace(PLAIN, moles=0, freckles=0), SIZE)
    assert np.array_equal(plain.specular, other.specular)
    assert 0.002 < (plain.diffuse != other.diffuse).any(-1)[plain.covered].mean() < 0.4
    darker = [(without.diffuse - skin.diffuse).max(-1) > 0.05 for skin in (plain, other)]
    assert (darker[0] & ~darker[1]).sum() > 20 and (darker[1] & ~darker[0]).sum() > 20
    assert (without.diffuse - plain.diffuse).min() > -1e-4  # a mole never lightens
    assert (plain.height - without.height).max() > 0.1  # and some are raised


def test_every_subject_is_plausible():
    for seed in range(3):
        skin = make_skin(seed, 128)
        inside = skin.diffuse[skin.covered]
        assert 0.01 < inside.mean() < 0.9 and inside.min() > 0 and inside.max() < 1
        assert 0.05 <= skin.specular.min() and skin.specular.max() <= 1 and np.abs(skin.height).max() < 3
        assert np.allclose(np.linalg.norm(skin.normal, axis=-1), 1, atol=1e-5) and skin.normal[..., 2].min() > 0

    def angle(p) -> float:
        skin = pigment.reflectance(np.array([p.melanin]), np.array([p.blood]), p.oxygen, p.scattering, p.slope)
        return pigment.typology_angle(skin)[0]

    angles = [angle(sample_parameters(seed)) for seed in range(200)]
    counts, _ = np.histogram(angles, [-60, -30, 10, 28, 41, 55, 70])  # the six classes of skin colour
    assert (counts > 5).all(), counts


def test_the_paint_does_not_know_where_the_uvs_are_cut(plain):
    mesh, on = template.load(), canvas(SIZE)
    right = mesh.uvs[mesh.face_uvs][..., 0].mean(1) > 0.5
    cut = replace(
        mesh,
        uvs=np.concatenate([mesh.uvs + [0.5, 0], mesh.uvs - [0.5, 0]]),
        face_uvs=mesh.face_uvs + right[:, None] * len(mesh.uvs),
    )
    moved = make_canvas(cut, SIZE, on.landmarks / 1000, lambda name: np.roll(template.mask(name, SIZE), SIZE // 2, 1))
    other = paint_skin(PLAIN, moved, canvas(GROUND))
    known = on.covered & np.roll(moved.covered, SIZE // 2, 1)
    assert known.mean() > 0.95 * on.covered.mean()
    # columns at the new cut, which runs through the middle of the face
    beside = np.abs(np.arange(SIZE) + 0.5 - SIZE / 2) < 8
    for name in ("diffuse", "specular", "height"):
        there, here = np.roll(getattr(other, name), SIZE // 2, 1), getattr(plain, name)
        apart = np.abs(there - here)[known & beside]
        assert apart.mean() < 0.05 * here[known].std() and np.median(apart) < 1e-3, name


def test_the_normals_of_a_ramp_are_its_slope_whatever_the_uv_layout():
    # a plane of 100 mm facing -Y; UVs turned by 30 degrees, scaled unevenly and sheared
    corners = np.array([[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]])
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]]) @ np.array([[5.0, 1.0], [0.0, 3.0]])
    uvs = (corners - 0.05) @ turn.T + 0.5
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices = np.stack([corners[:, 0], np.zeros(4), corners[:, 1]], 1)
    on = make_canvas(Mesh(vertices, faces, uvs, faces), 128, np.zeros((468, 3)), lambda name: np.zeros((128, 128)))
    tangent = np.linalg.inv(turn)[:, 0] / np.linalg.norm(np.linalg.inv(turn)[:, 0])
    bitangent = np.array([-tangent[1], tangent[0]])
    gradient = np.array([0.1, 0.2])  # mm per mm along x and z
    found = relief_normals((on.position[:, [0, 2]] @ gradient).astype(np.float32), on)
    expected = np.array([-gradient @ tangent, -gradient @ bitangent, 1.0])
    right = np.isclose(found, expected / np.linalg.norm(expected), atol=2e-3).all(-1)
    assert right.mean() > 0.995  # all but corner texels without a neighbour along one axis
    assert np.isclose(on.area.sum(), 100 * 100, rtol=0.02)
