# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames: the right ones of a video, the sharp ones chosen; every kind of bad source, and a capture with glasses, refused."""

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from skimage.data import astronaut

from core.capture.frame_records import FrameRecord
from core.capture.messages import CancelledError, Problem, Reporter
from core.face import faces
from core.face.glasses import sureness
from core.imaging import images
from core.settings.settings import from_json
from core.stages import frames
from core.stages.frames.glasses import SURE_LOG_ODDS, judge
from core.stages.frames.select import select_views, sharpness, turns
from core.stages.frames.source import fitted
from core.stages.frames.video import read_video
from tests.fixtures.moving_face import moving_face, number_in, refused, take


def write_video(path, pictures):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(24))
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.options = "yuv420p", {"crf": "12", "preset": "ultrafast"}
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path


def test_frames_are_those_the_record_says(capture, tmp_path):
    source = write_video(tmp_path / "entrée 0001.MOV", [moving_face(i) for i in range(50)])
    record, report = take(capture, source, max_frames=8, views=4)
    assert record["kind"] == "video"
    assert [f["video_frame"] for f in record["frames"]] == np.round(np.linspace(0, 49, 8)).astype(int).tolist()
    for frame in record["frames"]:
        assert number_in(images.read_srgb(capture.frames / frame["name"])) == frame["video_frame"]
        assert frame["time_s"] == pytest.approx(frame["video_frame"] / 24, abs=0.002)
        assert frame["face_box"] is not None and frame["sharpness"] > 0
    assert sum(f["selected"] for f in record["frames"]) == 4
    assert report.figures["frames"] == 8 and report.figures["share_with_face"] == 1
    assert capture.picture("frames", "selected").is_file()


def test_long_side_is_kept_and_nothing_is_enlarged():
    assert fitted(720, 960, 480) == (360, 480) and fitted(240, 240, 960) == (240, 240)


def test_sharp_frames_spread_over_the_turn_are_chosen():
    rng = np.random.default_rng(0)
    sharp, turn = rng.random(200), np.linspace(-60, 60, 200)
    chosen = select_views(sharp, turn, 10)
    assert len(chosen) == 10 and np.diff(turn[chosen]).max() < 24
    assert sharp[chosen].mean() > 0.85
    crowded = np.concatenate([np.zeros(180), np.linspace(0, 60, 20)])  # the camera lingered in front
    assert (crowded[select_views(sharp, crowded, 10)] > 5).sum() >= 7
    blurred = cv2.GaussianBlur(astronaut().astype(np.float32) / 255, (0, 0), 1.5)
    assert sharpness(blurred, None) < 0.8 * sharpness(astronaut().astype(np.float32) / 255, None)


def test_turn_is_carried_into_profile_but_not_far_from_a_face():
    yaws = [None] * 3 + list(range(-60, 60, 4)) + [None] * 20
    turn = turns([FrameRecord(name="", sharpness=1.0, selected=False, yaw_deg=yaw) for yaw in yaws])
    assert turn[0] < turn[1] < turn[2] < -60
    assert np.isnan(turn[-1]) and np.isfinite(turn[33])


def test_a_damaged_recording_gives_what_is_there(capture, tmp_path):
    pictures = [moving_face(i) for i in range(40)]
    whole = write_video(tmp_path / "whole.mp4", pictures)
    (tmp_path / "cut.mp4").write_bytes(whole.read_bytes()[:-4000])  # an MP4's index comes last
    refused(capture, tmp_path / "cut.mp4", "cut off")
    sound = write_video(tmp_path / "sound.mkv", pictures).read_bytes()
    half = len(sound) // 2
    for damaged in (sound[:half], sound[:half] + bytes(3000) + sound[half + 3000 :]):
        (tmp_path / "damaged.mkv").write_bytes(damaged)
        pictures = list(read_video(tmp_path / "damaged.mkv", 100, 960, Reporter("frames")))
        assert 10 < len(pictures) < 40 and all(number_in(each.srgb) == each.index for each in pictures[:10])


def test_bad_sources_are_refused(capture, tmp_path, folder):
    refused(capture, "", "No video")
    refused(capture, tmp_path / "gone.mp4", "no video")
    for content, words in ((b"", "empty"), (b"A shopping list.\n" * 99, "no video"), (bytes(2000), "no video")):
        (tmp_path / "bad.mp4").write_bytes(content)
        refused(capture, tmp_path / "bad.mp4", words)
    refused(capture, folder, "no photographs")
    (folder / "b.avif").write_bytes(b"avif")
    refused(capture, folder, "are AVIF files")
    (folder / "c.gif").write_bytes(b"GIF89a")
    refused(capture, folder, "are GIF and AVIF files")
    (folder / "a.dng").write_bytes(b"raw")
    refused(capture, folder, "None of the photographs")
    (folder / "0.png").write_bytes(b"cut off while it was copied")
    refused(capture, folder, "None of the photographs")


def test_no_face_and_no_motion_are_told(capture, tmp_path):
    rng = np.random.default_rng(0)
    scene = cv2.resize(rng.integers(0, 255, (40, 60, 3), np.uint8), (360, 240), interpolation=cv2.INTER_CUBIC)
    wall = [np.ascontiguousarray(scene[:, i : i + 240]) for i in range(3)]
    refused(capture, write_video(tmp_path / "wall.mp4", wall), "No face")
    refused(capture, write_video(tmp_path / "still.mp4", [moving_face(0)] * 3), "did not move")


def test_cancel_keeps_the_old_frames(capture, tmp_path):
    capture.root.mkdir(parents=True)
    capture.set_source(write_video(tmp_path / "clip.mp4", [moving_face(i) for i in range(4)]))
    capture.frames.mkdir()
    (capture.frames / "of before.jpg").touch()
    calls = iter([False] * 2)
    with pytest.raises(CancelledError):
        frames.run(capture, from_json({}), Reporter("frames", cancelled=lambda: next(calls, True)))
    assert [path.name for path in capture.frames.iterdir()] == ["of before.jpg"]
    assert not [p for p in capture.root.iterdir() if p.name.startswith(".")]


FACE = astronaut().astype(np.float32)[:300, 60:400] / 255


def with_rims(srgb: np.ndarray, thick: int = 4) -> np.ndarray:
    """Round black rims with a bridge and temples, painted over a face."""
    marks, over = faces.detect(srgb).landmarks[:, :2], srgb.copy()
    middles = [marks[list(corners)].mean(0) for corners in (faces.RIGHT_EYE, faces.LEFT_EYE)]
    reach = 0.36 * np.linalg.norm(middles[1] - middles[0])
    for middle in middles:
        circle = np.round(middle + [0, 0.15 * reach]).astype(int).tolist()
        cv2.circle(over, circle, round(reach), (0.03, 0.03, 0.03), thick, cv2.LINE_AA)
    across = (middles[1] - middles[0]) / np.linalg.norm(middles[1] - middles[0])
    ends = [
        (middles[0] + reach * across, middles[1] - reach * across),
        (middles[0] - reach * across, marks[234]),
        (middles[1] + reach * across, marks[454]),
    ]
    for a, b in np.round(ends).astype(int).tolist():
        cv2.line(over, a, b, (0.03, 0.03, 0.03), thick, cv2.LINE_AA)
    return over


def test_rims_are_told_from_a_bare_face_and_a_capture_with_glasses_is_refused(capture, folder):
    worn = with_rims(FACE)
    assert sureness(FACE, faces.detect(FACE)) < -1 and sureness(worn, faces.detect(worn)) > SURE_LOG_ODDS
    for k in range(3):
        images.write_srgb(folder / f"{k}.png", worn[10 * k : 10 * k + 260, 20 * k : 20 * k + 280])
    refused(capture, folder, "wears glasses in 3 of 3 frames")


@pytest.mark.parametrize(
    ("odds", "no_glasses", "finding"),
    [
        ([9.0, 9.0], False, True),
        ([9.0, 9.0, 1.0, 1.0, 9.0], False, True),
        ([0.7] * 10, False, True),
        ([9.0] * 5 + [-1.0] * 5, False, True),
        ([], False, False),
        ([float("nan")] * 4, False, False),
        ([-2.0] * 10 + [9.0] * 4, False, False),
        ([9.0] * 4, True, False),
    ],
)
def test_doubt_is_a_warning_and_few_frames_or_the_artist_refuse_nothing(odds, no_glasses, finding):
    report = Reporter("frames")
    judge(odds, no_glasses, report)
    assert ["glasses" in each["problem"] for each in report.findings] == [True] * finding


def test_the_remedy_says_how_to_overrule():
    with pytest.raises(Problem) as raised:
        judge([9.0] * 4, False, Reporter("frames"))
    assert "frames.no_glasses" in raised.value.remedy
