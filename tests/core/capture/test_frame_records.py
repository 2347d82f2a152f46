# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames.json: read and written in one place, byte for byte as it was; older and newer ones are read, damaged ones end
in a sentence."""

import dataclasses
import json

import pytest

from core.capture.capture import Capture
from core.capture.frame_records import FrameRecord, read_frames, write_frames
from core.capture.messages import Problem

WRITTEN = """{
 "kind": "video",
 "frames": [
  {
   "name": "00000.jpg",
   "video_frame": 0,
   "time_s": 0.0,
   "source": "",
   "size": [
    720,
    960
   ],
   "sharpness": 0.24862,
   "selected": true,
   "face_box": [
    257.3,
    324.3,
    514.2,
    641.5
   ],
   "face_score": 0.9965,
   "yaw_deg": -44.1,
   "focal_px": null,
   "blur": 0.4826,
   "brightness": 0.5424,
   "clipped": 0.0,
   "noise": 0.00097,
   "eyes_open": [
    0.411,
    0.299
   ],
   "blink": false,
   "other_face": 0.0,
   "gain": [
    1.0,
    1.0,
    1.0
   ]
  },
  {
   "name": "00007.jpg",
   "video_frame": 7,
   "time_s": null,
   "source": "tête à tête.jpg",
   "size": [
    720,
    960
   ],
   "sharpness": 0.1,
   "selected": false,
   "face_box": null,
   "face_score": 0.0,
   "yaw_deg": null,
   "focal_px": 812.5,
   "blur": 0.5,
   "brightness": 0.5,
   "clipped": 0.0,
   "noise": 0.001,
   "eyes_open": null,
   "blink": true,
   "other_face": 0.25,
   "gain": [
    1.02,
    1.0,
    0.98
   ]
  }
 ]
}"""
OLDEST = {"name": "00001.jpg", "sharpness": 0.2, "selected": True}


def capture_with(root, text: str) -> Capture:
    capture = Capture(root)
    capture.frames.mkdir()
    capture.frames_json.write_text(text, encoding="utf-8")
    return capture


def test_what_is_read_is_written_byte_for_byte(tmp_path):
    capture = capture_with(tmp_path, WRITTEN)
    frames = read_frames(capture)
    assert frames.kind == "video" and [record.name for record in frames.records] == ["00000.jpg", "00007.jpg"]
    assert frames.by_name["00000.jpg"].size == (720, 960) and frames.records[1].gain == (1.02, 1.0, 0.98)
    assert frames.records[0].shown == "00000.jpg" and frames.records[1].shown == "tête à tête.jpg"
    write_frames(tmp_path / "again", frames)
    assert (tmp_path / "again" / "frames.json").read_bytes() == WRITTEN.encode()
    changed = dataclasses.replace(frames.records[1], selected=True)
    write_frames(tmp_path / "again", dataclasses.replace(frames, records=(frames.records[0], changed)))
    again = (tmp_path / "again" / "frames.json").read_text(encoding="utf-8")
    assert again == WRITTEN.replace('"selected": false', '"selected": true')


def test_records_are_values():
    record = FrameRecord(**OLDEST)
    with pytest.raises(dataclasses.FrozenInstanceError):
        record.selected = False
    assert record == FrameRecord(**OLDEST) and len({record, FrameRecord(**OLDEST)}) == 1


def test_older_and_newer_files_are_read(tmp_path):
    newer = {"frames": [OLDEST, {**OLDEST, "name": "00002.jpg", "mood": "bright"}], "camera": "of tomorrow"}
    frames = read_frames(capture_with(tmp_path, json.dumps(newer)))
    assert frames.kind is None
    assert frames.records == (FrameRecord(**OLDEST), FrameRecord(**{**OLDEST, "name": "00002.jpg"}))
    first = frames.records[0]
    assert (first.video_frame, first.yaw_deg, first.focal_px) == (None, None, None)
    assert first.source == "" and first.gain == (1.0, 1.0, 1.0)
    write_frames(tmp_path / "again", frames)
    assert "kind" not in json.loads((tmp_path / "again" / "frames.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "3",
        "{}",
        '{"frames": 3}',
        '{"frames": [3]}',
        '{"frames": ["00000.jpg"]}',
        '{"frames": [{"name": "00000.jpg"}]}',
        json.dumps({"frames": [{**OLDEST, "name": 3}]}),
        json.dumps({"frames": [{**OLDEST, "sharpness": "much"}]}),
        WRITTEN[:-40],
    ],
)
def test_a_damaged_file_is_a_problem(tmp_path, text):
    with pytest.raises(Problem, match="frames of this capture cannot be read") as problem:
        read_frames(capture_with(tmp_path, text))
    assert problem.value.remedy.startswith("Run the stage Frames again")


def test_a_missing_file_and_one_in_another_encoding_are_problems(tmp_path):
    with pytest.raises(Problem, match="cannot be read"):
        read_frames(Capture(tmp_path))
    capture = capture_with(tmp_path, "")
    capture.frames_json.write_bytes(b"\xff\xfe{}")
    with pytest.raises(Problem, match="cannot be read"):
        read_frames(capture)
