# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The video doctor: bad captures end in the right diagnosis, blurred frames and blinks are left out, good ones hear
nothing of it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.frame_records import FrameRecord
from core.capture.messages import Reporter
from core.face import faces
from core.imaging import images
from core.stages import frames
from core.stages.frames.doctor import blurred, diagnose, examine
from core.stages.frames.eyes import blinks
from core.stages.frames.select import sharpness
from core.stages.frames.source import Picture
from tests.fixtures import moving_face
from tests.fixtures.refused import refused

FACE = astronaut().astype(np.float32)[:300, 60:400] / 255


def take(capture: Capture, pictures, **settings) -> tuple[list[dict], Reporter]:
    """The frames stage over photographs; the records and the reporter."""
    for i, picture in enumerate(pictures):
        images.write_srgb(capture.root.parent / "photographs" / f"{i:02d}.png", picture)
    record, report = moving_face.take(capture, capture.root.parent / "photographs", **settings)
    assert {p.name for p in capture.frames.glob("*.jpg")} == {r["name"] for r in record["frames"]}
    return record["frames"], report


def problems(report: Reporter) -> str:
    assert all(f["problem"].endswith(".") and f["remedy"].endswith(".") for f in report.findings)
    return " ".join(f["problem"] for f in report.findings)


def wander(i: int, picture=FACE) -> np.ndarray:
    return picture[i : i + 260, 2 * i : 2 * i + 280]


def shaken(picture: np.ndarray, length: int) -> np.ndarray:
    return cv2.blur(picture, (length, 1))


def lids_closed(picture: np.ndarray) -> np.ndarray:
    """The skin above each eye drawn down over it."""
    marks = faces.detect(picture).landmarks[:, :2]
    y, x = np.mgrid[0 : picture.shape[0], 0 : picture.shape[1]].astype(np.float32)
    source = y.copy()
    for corners, upper, lower, brow in ((faces.RIGHT_EYE, 159, 145, 105), (faces.LEFT_EYE, 386, 374, 334)):
        a, b = marks[list(corners)]
        across = np.clip(1 - ((x - (a + b)[0] / 2) / (0.62 * np.linalg.norm(a - b))) ** 2, 0, 1)
        top, low = marks[brow][1], marks[lower][1] + 1
        reach = low + (marks[upper][1] - 1.5 - low) * np.sqrt(across)
        source = np.where((y >= top) & (y <= low) & (across > 0), top + (y - top) / (low - top) * (reach - top), source)
    return cv2.remap(picture, x, source.astype(np.float32), cv2.INTER_LINEAR)


def test_blurred_frames_and_blinks_are_left_out_and_the_exposure_is_test_blurred_frames_and_blinks_are_left_out_and_the_exposure_is_evened(
    capture,
):
    shut = lids_closed(FACE)
    pictures = [wander(i, shut if i in (5, 11) else FACE) for i in range(18)]
    for i in (3, 9, 14):
        pictures[i] = shaken(pictures[i], 9)
    gain = np.where(np.arange(18) < 10, 1.0, 0.75).astype(np.float32)
    pictures = [images.linear_to_srgb(images.srgb_to_linear(p) * g) for p, g in zip(pictures, gain, strict=True)]
    records, report = take(capture, pictures, views=13)
    assert [r["video_frame"] for r in records] == [i for i in range(18) if i not in (3, 9, 14)]
    assert [r["video_frame"] for r in records if r["blink"]] == [5, 11]
    assert sum(r["selected"] for r in records) == 13 and not any(r["selected"] and r["blink"] for r in records)
    evened = np.array([r["gain"] for r in records]).mean(1) * gain[[r["video_frame"] for r in records]]
    assert np.ptp(np.log(evened)) < 0.05
    assert report.figures["frames_dropped_as_blurred"] == 3 and report.figures["frames_with_a_blink"] == 2
    assert report.figures["exposure_drift_percent"] == pytest.approx(33, abs=4)
    assert "3 of 18 photographs are blurred" in problems(report) and "exposure changed" in problems(report)
    blurred = [f["frames"] for f in report.findings if "blurred" in f["problem"]]
    assert blurred == [["00003.jpg", "00009.jpg", "00014.jpg"]]


def test_two_equal_faces_are_a_problem_and_a_smaller_one_is_passed_over(capture):
    couple = [np.concatenate([wander(2 * i)[:, 40:260]] * 2, 1) for i in range(2)]
    refused(lambda: take(capture, couple), "two faces")
    small = images.resize(FACE[40:210, 80:260], 90, 85)
    crowd = [np.concatenate([wander(2 * i), np.pad(small, ((120, 55), (0, 0), (0, 0)), "edge")], 1) for i in range(3)]
    records, report = take(capture, crowd)
    assert all(r["face_box"][2] < 280 and r["face_box"][2] - r["face_box"][0] > 80 for r in records), "the large face"
    assert "second face is in 3 of 3" in problems(report)


def record(**other) -> FrameRecord:
    """A frame with nothing wrong."""
    face = {"face_box": (200, 300, 520, 720), "yaw_deg": 0.0, "blur": 0.5, "brightness": 0.6, "noise": 0.002}
    frame = {"name": "00000.jpg", "time_s": 0.0, "size": (720, 960), "sharpness": 0.2, "selected": False}
    return FrameRecord(**{**frame, **face, **other})


def faceless(**other) -> FrameRecord:
    return record(face_box=None, yaw_deg=None, **other)


def around(low=-60, high=60, step=3, **other) -> list[FrameRecord]:
    return [
        record(name=f"{i:05d}.jpg", yaw_deg=float(yaw), **other) for i, yaw in enumerate(range(low, high + 1, step))
    ]


@pytest.mark.parametrize(
    ("records", "words"),
    [
        (around(), ""),
        (around(low=0), "left side"),
        (around(high=12), "right side of the face is hardly seen"),
        (around(low=-12, high=9, step=1), "from the front only"),
        ([r for r in around() if not 0 < r.yaw_deg < 40], "Between 0 and 42 degrees"),
        (around(brightness=0.12), "too dark"),
        (around(clipped=0.2), "overexposed: 20% of it"),
        (around(noise=0.04), "noisy"),
        ([replace(r, gain=(1 + 0.01 * i,) * 3) for i, r in enumerate(around())], "exposure changed by 40%"),
        ([replace(r, gain=(0.9 + 0.005 * i, 1.0, 1.1 - 0.005 * i)) for i, r in enumerate(around())], "white balance"),
        (around(face_box=[300, 400, 400, 540]), "small in the picture: 14%"),
        (around(face_box=[60, 60, 160, 190], size=[240, 320]), "only 100 pixels wide"),
        (around(blur=0.75), "blurred in most"),
        (around(step=15), "only 9 frames"),
        (around()[:40] + [faceless()] * 40, "No face was found in 40 of 80 frames"),
    ],
)
def test_each_shortcoming_has_its_sentence_and_a_good_capture_none(records, words):
    report = Reporter("frames")
    diagnose(records, [], False, report)
    assert words in problems(report)
    assert len(records) == 80 or len(report.findings) == bool(words), "nothing else is wrong"


def test_a_face_in_blurred_frames_alone_is_told():
    records = [faceless()] * 39 + [record(blur=0.8)]
    kept = [each for each, out in zip(records, blurred(records), strict=True) if not out]
    refused(lambda: diagnose(kept, ["00039.jpg"], False, Reporter("frames")), "only frames with a face are blurred")


def test_of_a_few_photographs_the_blurred_one_is_named():
    report = Reporter("frames")
    records = [replace(each, source=f"IMG_{i}.jpg", blur=0.45) for i, each in enumerate(around(-54, 54, 12))]
    records[4] = replace(records[4], blur=0.86)
    diagnose(records, [], True, report)
    (told,) = [finding for finding in report.findings if "blurred" in finding["problem"]]
    assert "1 of 10 photographs" in told["problem"] and "IMG_4.jpg" in told["problem"]
    assert told["frames"] == ["00004.jpg"]


@pytest.mark.parametrize("photographs", [True, False])
def test_sides_that_no_face_tells_are_believed_of_a_film_alone(photographs):
    """The camera of a film moves on into the profile; the last of twenty photographs may show anything."""
    report = Reporter("frames")
    diagnose([faceless()] * 2 + around(low=-28, high=28, step=4) + [faceless()] * 2, [], photographs, report)
    assert ("from the front only" in problems(report)) == photographs


def test_where_no_face_is_found_a_film_is_measured_at_the_last_one_and_a_photograph_at_the_person(monkeypatch):
    """A sharp back of the head to the right of a blurred wall, before which the last picture showed a face."""
    picture = np.full((300, 400, 3), 0.5, np.float32)
    picture[100:220, 260:380] = FACE[60:180, 100:220]
    person = np.zeros((300, 400), np.float32)
    person[100:220, 260:380] = 1
    monkeypatch.setattr(faces, "segment_person", lambda srgb: person)
    last = faces.Face((20, 40, 160, 200), np.zeros((468, 3)), 0.9)
    for time_s, box in ((None, (260, 100, 380, 220)), (1.0, last.box)):
        made = frames._record(Picture(picture, 0, time_s, "", None, 1, 1), "0.jpg", None, last, 0.0)
        assert made.sharpness == pytest.approx(sharpness(picture, box), abs=1e-5)
        assert made.blur == examine(picture, box)["blur"]
    assert examine(picture, last.box)["blur"] > 0.9 > 0.6 > examine(picture, (260, 100, 380, 220))["blur"]


def test_few_photographs_are_no_gaps_and_photographers_are_not_told_of_frames_and_videos():
    yaws = (0, -38, 41, None, None, 2, -1, 36, -40, 1)
    records = [record(yaw_deg=yaw, face_box=None if yaw is None else (200, 300, 520, 720), time_s=None) for yaw in yaws]
    report = Reporter("frames")
    diagnose(records, [], True, report)
    assert "only 10 photographs" in problems(report) and len(report.findings) == 1
    diagnose([record(time_s=None, other_face=0.5)] * 5 + [record(time_s=None)] * 10, [], True, report)
    assert "second face is in 5 of 15 photographs" in problems(report)
    diagnose([replace(each, yaw_deg=1.0) for each in records[:1]] * 3, [], True, report)
    assert "profiles" in report.findings[-1]["remedy"] and "front only" in report.findings[-1]["problem"]
    refused(lambda: diagnose([record(time_s=None, other_face=0.9)] * 5, [], True, report), "crop the photographs")


def test_the_measures_say_what_was_done_to_the_picture():
    rng = np.random.default_rng(0)
    box = faces.detect(FACE).box
    good = examine(FACE, box)
    assert good["blur"] < 0.55 and 0.4 < good["brightness"] < 0.9 and good["clipped"] < 0.05 and good["noise"] < 0.012
    assert examine(cv2.GaussianBlur(FACE, (0, 0), 3), box)["blur"] > 0.68
    assert examine(shaken(FACE, 15), box)["blur"] > 0.68
    assert examine(images.linear_to_srgb(0.04 * images.srgb_to_linear(FACE)), box)["brightness"] < 0.22
    assert examine(np.clip(2 * FACE, 0, 1), box)["clipped"] > 0.2
    noisy = (FACE + 0.05 * rng.normal(size=FACE.shape)).astype(np.float32)
    assert examine(noisy, box)["noise"] == pytest.approx(0.05 * 0.67, abs=0.01), "of luma"


def test_at_most_a_third_is_dropped_and_enough_stay():
    assert not blurred([record(blur=0.7)] * 30).any(), "equally blurred: nothing better is there"
    assert blurred([record(blur=0.75 if i % 5 in (1, 3) else 0.45) for i in range(60)]).sum() == 20
    assert not blurred([record(blur=0.75 if i == 3 else 0.45) for i in range(12)]).any()
    turning = [record(blur=0.45 + 0.004 * i) for i in range(40)]  # fewer edges towards the profile
    assert not blurred(turning).any()


def test_blinks_are_told_by_what_the_eyes_do_else():
    time = (np.arange(60) / 24).tolist()
    eyes = [(0.3, 0.34)] * 60
    blinking = [(0.1, 0.12) if 20 <= i < 25 else eye for i, eye in enumerate(eyes)]
    assert np.flatnonzero(blinks(blinking, time)).tolist() == list(range(20, 25))
    assert not blinks([(0.1, 0.12)] * 60, time).any(), "closed throughout"
    assert not blinks([(0.36 - 0.004 * i, 0.12 + 0.004 * i) for i in range(60)], time).any(), "a turn of the head"
    one_eye = [(0.1, 0.34) if i == 30 else eye for i, eye in enumerate(eyes)]
    assert not blinks(one_eye, time).any(), "one eye alone is a mistake or a wink"
    at_two = [(0.1, 0.1) if i == 2 else None if i == 5 else (0.3, 0.3) for i in range(9)]
    assert np.flatnonzero(blinks(at_two, [None] * 9)).tolist() == [2]
    assert not blinks([None] * 3, [None] * 3).any()
