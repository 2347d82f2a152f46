# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light stage and the portraits that the delighter learns from, on bodies and lights whose answer is known."""

import numpy as np
import pytest
import trimesh

from core.geometry.meshes import Mesh
from core.geometry.raster import RayCaster
from core.imaging import images
from research.people import olat, portrait, sight
from research.people.fitted_light import LampOnHead
from research.people.identities import subject_mesh
from research.people.skin import make_skin


def ball(radius: float = 0.1, centre=(0, 0, 0)) -> Mesh:
    sphere = trimesh.creation.icosphere(3, radius)
    return Mesh(np.asarray(sphere.vertices) + centre, np.asarray(sphere.faces))


@pytest.fixture(scope="module")
def seen():
    stage = olat.light_stage(subject_mesh(9100))
    return stage, portrait.sample_sight(stage, make_skin(9100, 256), np.random.default_rng(5), 96)


def test_a_floor_takes_half_the_light_of_a_wall():
    """Radiance 1 from above the horizon only: a vertical surface sees half of its hemisphere lit, an upward one all, a
    downward one nothing."""
    stage = olat.light_stage(ball())
    sky = (olat.DIRECTIONS[:, 2:] > 0).astype(np.float32) * np.ones(3, np.float32)
    shading = (olat.transport(stage, np.arange(len(stage.normals))) @ sky)[:, 0]
    height = stage.normals[:, 2]
    assert shading[height > 0.99] == pytest.approx(1, abs=0.03)
    assert shading[height < -0.99] == pytest.approx(0, abs=0.01)
    assert shading[np.abs(height) < 0.02].mean() == pytest.approx(0.5, abs=0.02)


def test_a_lamp_half_hidden_by_an_edge_gives_half_its_light():
    """A wall that ends on the line to the middle of the lamp hides half of its disc; farther away from the wall the
    whole disc is seen."""
    wall = Mesh(np.array([[0, -1, 1.0], [-2, -1, 1.0], [-2, 1, 1.0], [0, 1, 1.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    points, normals = np.array([[0, 0, 0], [0.5, 0, 0], [-0.5, 0, 0]]), np.repeat([[0, 0, 1.0]], 3, 0)
    points, normals = np.repeat(points, 200, 0), np.repeat(normals, 200, 0)
    share = olat.trace_sun(RayCaster(wall), points, normals, np.array([0, 0, 1.0]), 0.1, 16, np.random.default_rng(0))
    assert share.reshape(3, 200).mean(1) == pytest.approx([0.5, 1, 0], abs=0.03)


def test_a_picture_is_its_albedo_times_the_shading_of_even_skin(seen):
    stage, view = seen
    made, again, other = (portrait.relight_sight(view, stage, np.random.default_rng(seed)) for seed in (3, 3, 7))
    assert np.array_equal(made.srgb, again.srgb)
    assert np.array_equal(made.albedo, other.albedo) and not np.allclose(made.even, other.even, atol=0.1)
    on_head = made.head > 0.5
    clean = images.linear_to_srgb(made.albedo * made.even)
    assert np.abs(clean - made.srgb)[on_head].mean() < 0.05  # noise, blur and compression lie between
    assert made.skin[~on_head].max() == 0


def test_what_turns_away_from_the_only_lamp_is_in_its_shadow(seen):
    _, view = seen
    lamp = np.array([1.0, 0, 0])
    whole = np.ones(len(view.pixel), np.float32)
    shining = LampOnHead(lamp, np.full(3, 4.0), whole)
    lost, strong = portrait._shadow(view, [shining], [whole], np.ones((len(view.pixel), 3)))
    assert strong == pytest.approx(0.8)
    assert lost[view.smooth @ lamp < -0.1] == pytest.approx(1) and lost[view.smooth @ lamp > 0.1] == pytest.approx(0)


def test_a_sight_survives_its_file(seen, tmp_path):
    _, view = seen
    sight.save(tmp_path / "0.npz", view)
    again = sight.full(sight.load(tmp_path / "0.npz"))
    assert again.size == view.size and np.array_equal(again.pixel, view.pixel)
    assert np.abs(again.albedo - view.albedo).max() < 1e-3 and np.abs(again.reach - view.reach).max() < 0.003
    assert np.abs(again.at_pixels(np.ones((len(view.vertices), 1))) - 1).max() < 2e-3
