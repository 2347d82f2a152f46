# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A slow zoom is found in cameras that were solved with one focal length; films of one lens are left alone."""

import numpy as np
import pycolmap
import pytest

from core.capture.frame_records import FrameRecord
from core.stages.cameras import structure
from core.stages.cameras.zoom import _adjusted, slow_zooms

COUNT, FOCAL = 20, 600.0


def solved_with_one_focal_length(zooms) -> tuple[pycolmap.Reconstruction, list[FrameRecord]]:
    """An arc of cameras around a ball before a far room, seen with these zooms, fitted with one focal length."""
    rng = np.random.default_rng(1)
    ball = rng.normal(size=(150, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    points = np.concatenate([0.4 * ball, rng.uniform((-4, -2, -4), (4, 2, 4), (150, 3))])
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        camera_id=1, model="SIMPLE_RADIAL", width=640, height=480, params=[FOCAL * np.mean(zooms), 320, 240, 0]
    )
    model.add_camera_with_trivial_rig(camera)
    tracks = [[] for _ in points]
    for number, (angle, zoom) in enumerate(zip(np.linspace(-0.6, 0.6, COUNT), zooms, strict=True), 1):
        turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
        local = points @ turn.T + (0, 0, 2.0)
        pixels = FOCAL * zoom * local[:, :2] / local[:, 2:] + (320, 240) + rng.normal(0, 0.3, (len(points), 2))
        seen = (local[:, 2] > 0.5) & (pixels > 0).all(1) & (pixels < (640, 480)).all(1)
        image = pycolmap.Image(name=f"{number:05d}.jpg", camera_id=1, image_id=number, keypoints=pixels[seen])
        pose = pycolmap.Rigid3d(np.concatenate([turn, [[0], [0], [2.0]]], 1))
        model.add_image_with_trivial_frame(image, pose)
        for place, point in enumerate(np.flatnonzero(seen)):
            tracks[point].append(pycolmap.TrackElement(number, place))
    for place, elements in zip(points, tracks, strict=True):
        if len(elements) > 2:
            model.add_point3D(place, pycolmap.Track(elements), np.zeros(3, np.uint8))
    _adjusted(model)
    names = [f"{number:05d}.jpg" for number in range(1, COUNT + 1)]
    return model, [FrameRecord(name=name, sharpness=1.0, selected=False) for name in names]


def test_a_slow_zoom_gives_each_stretch_its_magnification():
    course = np.linspace(1, 1.5, COUNT)
    zooms = slow_zooms(*solved_with_one_focal_length(course))
    assert zooms is not None and np.corrcoef(zooms, course)[0, 1] > 0.95 and zooms[-1] / zooms[0] > 1.2


@pytest.mark.parametrize("breathing", [0.0, 0.01])
def test_one_lens_is_left_alone_even_if_it_breathes(breathing):
    course = 1 + breathing * np.sin(np.linspace(0, 6, COUNT))
    assert slow_zooms(*solved_with_one_focal_length(course)) is None


def test_frames_of_one_zoom_share_a_camera(tmp_path, monkeypatch):
    monkeypatch.setattr(structure.images, "size", lambda path: (640, 480))
    zooms = (1.0, 1.0, 1.5, 1.5, 1.0)
    records = [FrameRecord(name=f"{i}.jpg", sharpness=1.0, selected=False, zoom=zoom) for i, zoom in enumerate(zooms)]
    groups = structure.camera_groups(records, tmp_path)
    assert [(group["names"], group["zoom"]) for group in groups] == [
        (["0.jpg", "1.jpg", "4.jpg"], 1.0),
        (["2.jpg", "3.jpg"], 1.5),
    ]
