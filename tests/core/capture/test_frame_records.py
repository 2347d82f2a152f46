# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames.json: one reader and one writer; older and newer files are read, damaged ones are a Problem."""

import dataclasses
import json

import pytest

from core.capture.capture import Capture
from core.capture.frame_records import FrameRecord, read_frames, write_frames
from core.capture.messages import Problem
from tests.fixtures.refused import refuses

FULL = """{"name": "00000.jpg", "video_frame": 0, "time_s": 0.0, "source": "tête à tête.jpg", "size": [720, 960],
"sharpness": 0.24862, "selected": true, "face_box": [257.3, 324.3, 514.2, 641.5], "face_score": 0.9965, "yaw_deg": -44.1,
"focal_px": 812.5, "blur": 0.4826, "brightness": 0.5424, "clipped": 0.0, "noise": 0.00097, "eyes_open": [0.411, 0.299],
"blink": true, "other_face": 0.25, "gain": [1.02, 1.0, 0.98]}"""
OLDEST = {"name": "00001.jpg", "sharpness": 0.2, "selected": True}


def capture_with(root, text: str) -> Capture:
    capture = Capture(root)
    capture.frames.mkdir()
    capture.frames_json.write_text(text, encoding="utf-8")
    return capture


def test_what_is_read_is_written_byte_for_byte(tmp_path):
    content = {"kind": "video", "frames": [json.loads(FULL)]}
    text = json.dumps(content, indent=1, ensure_ascii=False)
    frames = read_frames(capture_with(tmp_path, text))
    record = frames.by_name["00000.jpg"]
    assert frames.kind == "video" and record.size == (720, 960) and record.gain == (1.02, 1.0, 0.98)
    assert (record.shown, FrameRecord(**OLDEST).shown) == ("tête à tête.jpg", "00001.jpg")
    write_frames(tmp_path / "again", frames)
    assert (tmp_path / "again" / "frames.json").read_text(encoding="utf-8") == text
    write_frames(tmp_path / "again", dataclasses.replace(frames, kind=None))
    assert "kind" not in (tmp_path / "again" / "frames.json").read_text(encoding="utf-8")


def test_older_and_newer_files_are_read(tmp_path):
    newer = {"frames": [OLDEST, {**OLDEST, "name": "00002.jpg", "mood": "bright"}], "camera": "of tomorrow"}
    frames = read_frames(capture_with(tmp_path, json.dumps(newer)))
    assert frames.kind is None
    assert frames.records == (FrameRecord(**OLDEST), FrameRecord(**{**OLDEST, "name": "00002.jpg"}))
    first = frames.records[0]
    assert (first.video_frame, first.yaw_deg, first.focal_px) == (None, None, None)
    assert first.source == "" and first.gain == (1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"frames": 3}',
        '{"frames": ["00000.jpg"]}',
        '{"frames": [{"name": "00000.jpg"}]}',
        *(
            json.dumps({"frames": [{**OLDEST, key: value}]})
            for key, value in (
                ("name", 3),
                ("sharpness", "much"),
                ("selected", 1),
                ("size", [0, 960]),
                ("size", [720]),
                ("gain", None),
                ("video_frame", -1),
                ("focal_px", -1.0),
                ("blur", True),
                ("source", None),
            )
        ),
    ],
)
def test_a_damaged_file_is_a_problem(tmp_path, text):
    with pytest.raises(Problem, match="frames of this capture cannot be read") as problem:
        read_frames(capture_with(tmp_path, text))
    assert "Frames" in problem.value.remedy


@pytest.mark.parametrize("content", [None, b"\xff\xfe{}"])
def test_a_missing_file_and_one_in_another_encoding_are_problems(tmp_path, content):
    capture = capture_with(tmp_path, "")
    capture.frames_json.unlink() if content is None else capture.frames_json.write_bytes(content)
    refuses("cannot be read", read_frames, capture)
