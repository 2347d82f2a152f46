# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP models of a capture: binary ones and text are read, and damaged ones refused by name before they take memory."""

import json
import shutil
import struct

import numpy as np
import pytest

pycolmap = pytest.importorskip("pycolmap")

from core.capture.capture import Capture  # noqa: E402
from core.geometry.models import read_model  # noqa: E402
from core.geometry.views import read_views  # noqa: E402
from core.imaging import images  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402


@pytest.fixture
def capture(tmp_path) -> Capture:
    """One frame with its camera."""
    capture = Capture(tmp_path / "a.wildcap")
    capture.cameras.mkdir(parents=True)
    capture.frames.mkdir()
    capture.frames_json.write_text(json.dumps({"frames": [{"name": "00000.jpg", "sharpness": 0.5, "selected": True}]}))
    write_model(capture, "00000.jpg")
    return capture


def write_model(capture: Capture, name: str, text: bool = False) -> None:
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="PINHOLE", width=720, height=960, params=[900, 900, 360, 480])
    )
    model.add_image_with_trivial_frame(
        pycolmap.Image(name=name, camera_id=1, image_id=1), pycolmap.Rigid3d(np.eye(4)[:3])
    )
    model.add_point3D(np.zeros(3), pycolmap.Track(), np.zeros(3, np.uint8))
    (model.write_text if text else model.write)(str(capture.cameras))


@pytest.mark.parametrize(("height", "width"), [(7, 300), (960, 719)])
def test_a_frame_that_has_another_size_than_its_camera_is_refused_by_name(capture, height, width):
    images.write_srgb(capture.frames / "00000.jpg", np.full((height, width, 3), 0.5, np.float32))
    (view,) = read_views(capture)
    refused(view.read, "00000.jpg", f"is {width} x {height}", "solved for 720 x 960", "Frames again")


def test_sound_models_are_read(capture):
    assert [view.name for view in read_views(capture)] == ["00000.jpg"]
    assert len(read_model(capture.cameras).points3D) == 1
    shutil.rmtree(capture.cameras)
    capture.cameras.mkdir()
    write_model(capture, "00000.jpg", text=True)
    assert [view.name for view in read_views(capture)] == ["00000.jpg"]


@pytest.mark.parametrize("name", ["cameras", "images", "points3D", "rigs", "frames"])
def test_models_that_promise_what_they_do_not_hold(capture, name):
    path = capture.cameras / f"{name}.bin"
    sound = path.read_bytes()
    contents = [sound[:-1], sound + b"\0", b"", struct.pack("<Q", 1 << 40) + sound[8:], sound[:20]]
    if name == "points3D":
        contents.append(sound[:-8] + struct.pack("<Q", 10**9))  # a track of so many images
    for content in contents:
        path.write_bytes(content)
        refused(lambda: read_views(capture), path.name)


@pytest.mark.parametrize(("at", "value"), [(32, np.nan), (32, 0.0), (32, -900.0), (48, np.inf)])
def test_lenses_that_are_none(capture, at, value):
    path = capture.cameras / "cameras.bin"
    content = bytearray(path.read_bytes())
    struct.pack_into("<d", content, at, value)
    path.write_bytes(content)
    refused(lambda: read_views(capture), "cameras of this capture")


@pytest.mark.parametrize("name", ["../../private/x.jpg", "/etc/x.jpg", "a/b.jpg"])
def test_a_model_names_frames_and_no_paths(capture, name):
    write_model(capture, name)
    refused(lambda: read_views(capture), "no name of a frame")
