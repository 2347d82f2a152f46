# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the page of what a head looks like is made of: where cameras look, and a head put where the true one is."""

import numpy as np
import pytest

from core.face import template
from core.geometry import meshes
from core.imaging import images
from research.benchmarks import head_closeups
from research.people import sample, scene
from research.people.identities import subject_mesh


def middle(place: int | str) -> np.ndarray:
    rows, weights = head_closeups.weights_at(place)
    return np.array(weights) @ template.load().vertices[rows]


def test_cameras_look_at_what_the_picture_names():
    assert middle(4) == pytest.approx(template.landmark_points(template.load())[4])
    ear, nose, neck = middle("ears"), middle(4), middle("neck")
    assert ear[0] > 0.05 and abs(ear[2] - nose[2]) < 0.04
    assert neck[2] < nose[2] - 0.06 and neck[0] > 0


def test_the_frame_is_one_with_a_truth_and_from_the_front():
    number = head_closeups.front_frame()
    assert (sample.SAMPLE / "face" / f"{number:04d}.png").is_file()
    camera = scene.camera_path(sample.RESERVED["sample"], head_closeups.FRAMES)[number]
    assert abs(camera[0, 3]) < 0.1 and camera[1, 3] < -0.3
    frame = head_closeups.read_frame(number)
    face = images.read_mask(sample.SAMPLE / "face" / f"{number:04d}.png") > 0.5
    albedo = images.read_srgb(sample.SAMPLE / "albedo" / f"{number:04d}.png")[..., :3]
    assert np.corrcoef(frame[face].mean(1), albedo[face].mean(1))[0, 1] > 0.2  # the same moment of the film


def test_a_head_is_put_where_the_true_one_is(tmp_path):
    true = subject_mesh(sample.RESERVED["sample"])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    meshes.write_obj(tmp_path / "head.obj", true.moved(2.5 * true.vertices @ turn.T + [1.0, 2.0, 3.0]))
    grey = np.full((16, 16, 3), 0.5, np.float32)
    images.write_srgb(tmp_path / "maps" / "diffuse_albedo.png", grey)
    images.write_data(tmp_path / "maps" / "specular_albedo.png", 0.4 * grey[..., 0])
    images.write_data(tmp_path / "maps" / "normal.png", np.broadcast_to(np.float32([0.5, 0.5, 1.0]), grey.shape))
    skin, head = head_closeups.read_head(tmp_path)
    assert head.vertices == pytest.approx(true.vertices, abs=1e-5)
    assert skin.diffuse == pytest.approx(images.srgb_to_linear(grey), abs=2e-3)
    assert skin.specular == pytest.approx(np.full((16, 16), 0.2), abs=3e-3)
    assert skin.normal == pytest.approx(np.broadcast_to([0, 0, 1.0], grey.shape), abs=6e-3)


def test_flip_shows_where_a_head_differs_and_nothing_off_the_face():
    picture, mask = np.full((48, 48, 3), 0.5, np.float32), np.zeros((48, 48), bool)
    mask[12:36, 12:36] = True
    same = head_closeups.flip_map(picture, picture, mask)
    assert (same == same[0, 0]).all()
    other = np.where(np.mgrid[0:48, 0:48][1][..., None] > 24, picture + 0.3, picture).astype(np.float32)
    differs = np.abs(head_closeups.flip_map(other, picture, mask) - same).max(2) > 0.01
    assert differs[20:28, 28:34].all() and not differs[20:28, 14:18].any() and not differs[:4].any()
