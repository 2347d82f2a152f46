# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The records of a capture: JSON in any style is read; what is damaged, or names what is not its own, is refused by
name."""

import json
import os
from itertools import count

import pytest

from core.__main__ import main
from core.capture import artist_landmarks, own_head
from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.capture.json_files import read_json
from core.capture.regular_files import require_regular
from core.worker.job import write_job
from tests.fixtures.recorded import make_entry
from tests.fixtures.refused import refused

FRAME = {"name": "00000.jpg", "sharpness": 0.5, "selected": True}
WRONG = [
    "null",
    "[]",
    "3",
    "[" * 100_000,
    '{"a":' * 2000 + "1" + "}" * 2000,
    '{"stages": ' + "1" + "0" * 400 + "}",
    '{"stages": {"x": 1e400}}',
    '"\\ud800"',
    '{"stages": ["\\ud800"]}',
]


@pytest.mark.parametrize(
    "name",
    ["../../private/x.jpg", "/etc/x.jpg", "a/b.jpg", "a\\b.jpg", "C:x.jpg", "..", ".", "", "a\0b", 3, None, ["a"]],
)
def test_frames_have_names_without_a_path(tmp_path, name):
    capture = Capture(tmp_path)
    capture.frames.mkdir()
    capture.frames_json.write_text(json.dumps({"frames": [{**FRAME, "name": name}]}))
    refused(lambda: read_frames(capture), "frames.json", "no name of a frame")


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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_pipe_under_a_records_name_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "capture.json")
    for read in (read_json, require_regular):
        with pytest.raises(OSError, match="a pipe or a device"):
            read(tmp_path / "capture.json")
    with pytest.raises(FileNotFoundError):
        require_regular(tmp_path / "none")
