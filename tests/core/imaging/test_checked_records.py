# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras, frames, records and deliveries: what is damaged, or names what is not its own, is refused by name."""

import json
import os
import shutil
import struct
from itertools import count

import numpy as np
import pytest

pytest.importorskip("OpenImageIO")
pycolmap = pytest.importorskip("pycolmap")

from core.__main__ import main  # noqa: E402
from core.capture import artist_landmarks, own_head  # noqa: E402
from core.capture.capture import Capture  # noqa: E402
from core.capture.frame_records import read_frames  # noqa: E402
from core.capture.messages import Done, Failed, Log, Message  # noqa: E402
from core.geometry.models import read_model  # noqa: E402
from core.geometry.views import read_views  # noqa: E402
from core.imaging import images  # noqa: E402
from core.stages.cameras.calibration import read_cameras  # noqa: E402
from core.worker.job import write_job  # noqa: E402
from core.worker.runner import run_job  # noqa: E402
from tests.fixtures import delivered  # noqa: E402
from tests.fixtures.recorded import make_entry  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402

FRAME = {"name": "00000.jpg", "sharpness": 0.5, "selected": True}


# -- cameras


@pytest.fixture
def capture(tmp_path) -> Capture:
    """One frame with its camera."""
    capture = Capture(tmp_path / "a.wildcap")
    capture.cameras.mkdir(parents=True)
    capture.frames.mkdir()
    capture.frames_json.write_text(json.dumps({"frames": [FRAME]}))
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
    counted = struct.pack("<Q", 1 << 40) + sound[8:]
    for content in (sound[:-1], sound + b"\0", b"", counted, sound[:20]):
        path.write_bytes(content)
        refused(lambda: read_views(capture), path.name)


def test_a_track_of_a_thousand_million_images_takes_no_memory(capture):
    path = capture.cameras / "points3D.bin"
    path.write_bytes(path.read_bytes()[:-8] + struct.pack("<Q", 10**9))
    refused(lambda: read_views(capture), "points3D.bin")


@pytest.mark.parametrize(("at", "value"), [(32, np.nan), (32, 0.0), (32, -900.0), (48, np.inf)])
def test_lenses_that_are_none(capture, at, value):
    path = capture.cameras / "cameras.bin"
    content = bytearray(path.read_bytes())
    struct.pack_into("<d", content, at, value)
    path.write_bytes(content)
    refused(lambda: read_views(capture), "cameras of this capture")


@pytest.mark.parametrize(
    "name",
    ["../../private/x.jpg", "/etc/x.jpg", "a/b.jpg", "a\\b.jpg", "C:x.jpg", "..", ".", "", "a\0b", 3, None, ["a"]],
)
def test_frames_have_names_without_a_path(capture, name):
    capture.frames_json.write_text(json.dumps({"frames": [{**FRAME, "name": name}]}))
    refused(lambda: read_frames(capture), "frames.json", "no name of a frame")
    if isinstance(name, str) and "/" in name:
        capture.frames_json.write_text(json.dumps({"frames": [FRAME]}))
        write_model(capture, name)
        refused(lambda: read_views(capture), "no name of a frame")


def test_names_in_every_script_are_names(capture):
    for name in ("Zoë – 1 (2).jpg", "顔 写真.png", "a..b.jpg", "c.jpg"):
        capture.frames_json.write_text(
            json.dumps({"frames": [{**FRAME, "name": name}]}, ensure_ascii=False), encoding="utf-8"
        )
        assert read_frames(capture).records[0].name == name


# -- JSON

DEEP = "[" * 100_000
HUGE = "1" + "0" * 400
WRONG = [
    "null",
    "[]",
    "3",
    DEEP,
    '{"a":' * 2000 + "1" + "}" * 2000,
    '{"stages": ' + HUGE + "}",
    '{"stages": {"x": 1e400}}',
    '"\\ud800"',
    '{"stages": ["\\ud800"]}',
]


@pytest.mark.parametrize(
    "text",
    [
        *WRONG,
        '{"stages": null}',
        '{"stages": {}}',
        '{"stages": {}, "format": "2"}',
        *(
            json.dumps({"format": 2, "stages": {}, **wrong})
            for wrong in (
                {"source": 3},
                {"stopped": {}},
                {"source_stamp": [[1, 2]]},
                {"source_stamp": [["film.mp4", 6, 1]]},
                {"stages": {"solve": None}},
                {"stages": {"solve": make_entry(seconds="1")}},
                {"stages": {"solve": make_entry(inputs=None)}},
                {"stages": {"solve": make_entry(findings=[3])}},
                {"stages": {"solve": {"seconds": 1}}},
            )
        ),
    ],
    ids=count(),
)
def test_capture_records_of_every_wrong_kind(tmp_path, text, capsys):
    capture = Capture(tmp_path)
    capture.json.write_text(text)
    refused(capture.read, "capture.json")
    assert main(["status", str(tmp_path)]) == 2 and "Traceback" not in capsys.readouterr().err


def test_a_record_of_tomorrow_is_told_whatever_its_form(tmp_path):
    (tmp_path / "capture.json").write_text('{"format": 9, "stages": {"solve": [1, 2]}}')
    refused(Capture(tmp_path).read, "newer version")


@pytest.mark.parametrize("text", WRONG, ids=count())
def test_other_files_of_every_wrong_kind(tmp_path, text):
    capture = Capture(tmp_path)
    for path in (capture.landmarks_artist, capture.frames_json, capture.own_head_skin):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    refused(lambda: artist_landmarks.read(capture.landmarks_artist), "landmarks_artist.json")
    refused(lambda: read_frames(capture), "frames.json")
    refused(lambda: own_head.read_skin(capture, 9), "own_head.json")
    capture.landmarks_artist.write_text('{"points": {"1": [' + "1" * 30 + ", 0, 0]}}")
    refused(lambda: artist_landmarks.read(capture.landmarks_artist), "not on the head")


@pytest.mark.parametrize("runs", [[[0, 10]], [[-1, 2]], [[2, 2]], [[0.5, 2]], [[0]], "ab", None])
def test_skin_that_is_not_on_the_mesh(tmp_path, runs):
    capture = Capture(tmp_path)
    capture.own_head_skin.write_text(json.dumps({"template": "a.obj", "skin_triangles": runs}))
    refused(lambda: own_head.read_skin(capture, 9), "own_head.json", "registration")
    capture.own_head_skin.write_text(json.dumps({"template": "a.obj", "skin_triangles": [[0, 4], [6, 9]]}))
    assert own_head.read_skin(capture, 9) == ("a.obj", [(0, 4), (6, 9)])


@pytest.mark.skipif(os.name == "nt", reason="names are text there")
def test_names_that_are_no_text(tmp_path, capsys):
    photographs = tmp_path / "photos"
    photographs.mkdir()
    (photographs / "a\udcff.jpg").write_bytes(b"")
    for source, root in (
        (photographs, "a.wildcap"),
        (tmp_path / "film\udcff.mp4", "a.wildcap"),
        ("", "a\udcff.wildcap"),
    ):
        refused(lambda source=source, root=root: write_job(Capture(tmp_path / root), source=source), "udcff", "Rename")
    assert main(["run", str(photographs), str(tmp_path / "b.wildcap")]) == 2
    assert "not in UTF-8" in capsys.readouterr().err


# -- what is delivered


def deliver(root, change=lambda capture: None, **settings) -> tuple[Message, str]:
    """How a delivery ended, and its log, after `change` was done to a solved capture."""
    capture, said = delivered.make(root), []
    change(capture)
    ended = run_job(
        write_job(capture, tool="deliver", settings={"deliver": {"format": "obj", "whole": True}, **settings}),
        said.append,
    )
    assert isinstance(ended, Done) == bool(list(capture.exports.glob("*")))
    return ended, " ".join(message.text for message in said if isinstance(message, Log))


def cut(name: str, left: float):
    def change(capture: Capture) -> None:
        path = capture.root / name
        path.write_bytes(path.read_bytes()[: int(left * path.stat().st_size)])
        if left == 0.6:
            delivered.record_solve(capture)  # nothing on record tells that it was whole

    return change


@pytest.mark.parametrize(
    ("name", "left"),
    [
        ("maps/normal.png", 0.5),
        ("maps/diffuse_albedo.png", 0.9),
        ("maps/specular_albedo.png", 0.5),
        ("head.obj", 0.5),
        ("head.obj", 0.6),
        ("maps/normal.png", 0.0),
    ],
)
def test_cut_files_are_not_delivered(tmp_path, name, left):
    ended, _ = deliver(tmp_path / "a.wildcap", cut(name, left))
    assert isinstance(ended, Failed) and name.split("/")[-1] in ended.problem and ended.remedy.endswith(".")
    assert "An error inside" not in ended.problem


def test_what_is_out_of_date_is_not_delivered_and_what_is_older_is_named(tmp_path):
    ended, log = deliver(tmp_path / "a.wildcap")
    assert isinstance(ended, Done) and "older code" in log and "Solve" in log
    ended, _ = deliver(tmp_path / "b.wildcap", solve={"steps": 30})
    assert (
        isinstance(ended, Failed)
        and "Solve is out of date: solve.steps changed" in ended.problem
        and "stage Solve" in ended.remedy
    )
    ended, _ = deliver(tmp_path / "c.wildcap", lambda capture: images.write_data(capture.shadow_mask, np.ones((8, 8))))
    assert isinstance(ended, Failed) and "shadow_mask.png changed" in ended.problem
    ended, _ = deliver(
        tmp_path / "d.wildcap", lambda capture: images.write_data(capture.maps / "normal.png", np.ones((8, 16)))
    )
    assert isinstance(ended, Failed) and "normal.png" in ended.problem


# -- other programs' cameras


@pytest.mark.parametrize(
    "camera",
    [
        {"width": 0},
        {"height": -5},
        {"width": HUGE},
        {"focal_px": "NaN"},
        {"focal_px": 1e300 * 10},
        {"name": "a" + "1" * 5000},
        {"frame": DEEP},
    ],
    ids=count(),
)
def test_cameras_of_other_programs(tmp_path, camera):
    sound = {"width": 720, "height": 960, "focal_px": 900.0, "name": "1", "matrix_world": np.eye(4).tolist()}
    for value, right in ((sound | camera, list(camera) == ["name"]), (sound, True)):
        (tmp_path / "cameras.json").write_text(json.dumps({"cameras": [value]}))
        if right:
            assert len(read_cameras(tmp_path / "cameras.json")) == 1
        else:
            refused(lambda: read_cameras(tmp_path / "cameras.json"), "cameras.json")
    (tmp_path / "cameras.json").write_text(DEEP)
    refused(lambda: read_cameras(tmp_path / "cameras.json"), "cameras.json")
