# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames: the right ones, upright, in true colour, the sharp ones chosen; and every kind of bad source told in a
sentence."""

import json
import struct
from fractions import Fraction

import av
import cv2
import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.frame_records import FrameRecord
from core.capture.messages import CancelledError, Problem, Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages import frames
from core.stages.frames.colour import HLG, to_srgb
from core.stages.frames.select import select_views, sharpness, turns

SIZE = 240


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Chloé à l'été" / "my face.wildcap")


def moving_face(index: int) -> np.ndarray:
    """uint8 [SIZE, SIZE, 3]: a face that wanders, with the frame's number in eight black or white blocks along the
    lower edge."""
    left, top = 100 + 2 * (index % 20), 10 + index % 20
    picture = np.ascontiguousarray(astronaut()[top : top + SIZE, left : left + SIZE])
    for bit in range(8):
        picture[-24:, bit * 24 : (bit + 1) * 24] = 255 * (index >> bit & 1)
    return picture


def number_in(picture: np.ndarray) -> int:
    return sum(int(picture[-12, bit * 24 + 12].mean() > 0.5) << bit for bit in range(8))


def write_video(path, pictures, codec="libx264", **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=Fraction(24))
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.options = "yuv420p", {"crf": "12", "preset": "ultrafast"}
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path


def take(capture: Capture, source, **settings) -> tuple[dict, Reporter]:
    report = Reporter("frames")
    capture.root.mkdir(parents=True, exist_ok=True)
    capture.set_source(source)
    frames.run(capture, from_json({"frames": settings}), report)
    return json.loads(capture.frames_json.read_text(encoding="utf-8")), report


def refused(capture: Capture, source, **settings) -> Problem:
    with pytest.raises(Problem) as caught:
        take(capture, source, **settings)
    assert not capture.frames.exists()
    assert caught.value.problem.endswith(".") and caught.value.remedy.endswith(".")
    return caught.value


@pytest.mark.parametrize(
    ("name", "codec"), [("vidéo.mp4", "libx264"), ("IMG 0001.MOV", "libx265"), ("clip.mkv", "libx264")]
)
def test_frames_are_those_the_record_says(capture, tmp_path, name, codec):
    source = write_video(tmp_path / "une entrée" / name, [moving_face(i) for i in range(50)], codec)
    record, report = take(capture, source, max_frames=12, views=5)
    assert record["kind"] == "video" and len(record["frames"]) == 12
    assert [f["video_frame"] for f in record["frames"]] == np.round(np.linspace(0, 49, 12)).astype(int).tolist()
    for frame in record["frames"]:
        assert number_in(images.read_srgb(capture.frames / frame["name"])) == frame["video_frame"]
        assert frame["time_s"] == pytest.approx(frame["video_frame"] / 24, abs=0.002)
        assert frame["face_box"] is not None and frame["sharpness"] > 0
    assert sum(f["selected"] for f in record["frames"]) == 5
    assert report.figures["frames"] == 12 and report.figures["share_with_face"] == 1
    assert capture.picture("frames", "selected").is_file()


def test_long_side_is_kept_and_nothing_is_enlarged(capture, tmp_path):
    big = [np.ascontiguousarray(cv2.resize(moving_face(i), (720, 960))) for i in range(4)]
    record, _ = take(capture, write_video(tmp_path / "big.mp4", big), long_side=480)
    assert images.size(capture.frames / record["frames"][0]["name"]) == (360, 480)
    record, _ = take(capture, write_video(tmp_path / "small.mp4", [moving_face(i) for i in range(4)]))
    assert images.size(capture.frames / record["frames"][0]["name"]) == (SIZE, SIZE)


@pytest.mark.parametrize("quarter_turns", [1, 2, 3])
def test_rotation_metadata_is_honoured(capture, tmp_path, quarter_turns):
    """The pictures are stored turned, and the track header's matrix says how a player turns them back, as phones do."""
    stored = [np.ascontiguousarray(np.rot90(moving_face(i)[:, :200], quarter_turns)) for i in range(5)]
    path = write_video(tmp_path / "turned.mp4", stored)
    data = bytearray(path.read_bytes())
    matrix = {1: (0, 1, -1, 0), 2: (-1, 0, 0, -1), 3: (0, -1, 1, 0)}[quarter_turns]  # clockwise by as many quarters
    a, b, c, d = (value * 65536 for value in matrix)
    at = data.index(b"tkhd") + 4 + 40
    assert struct.unpack(">9i", data[at : at + 36])[0] == 65536  # the identity, where the specification puts it
    data[at : at + 36] = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 0x40000000)
    path.write_bytes(data)
    record, _ = take(capture, path)
    picture = images.read_srgb(capture.frames / record["frames"][3]["name"])
    assert picture.shape[:2] == (SIZE, 200)
    assert np.abs(picture - moving_face(3)[:, :200] / 255).mean() < 0.03


def test_rec709_video_keeps_its_colour(capture, tmp_path):
    path = tmp_path / "phone.mp4"
    shown = [moving_face(i) for i in range(4)]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(24))
        stream.height = stream.width = SIZE
        stream.pix_fmt, stream.options = "yuv420p", {"crf": "5"}
        stream.codec_context.colorspace = 1
        for picture in shown:
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            container.mux(
                stream.encode(frame.reformat(format="yuv420p", src_colorspace="DEFAULT", dst_colorspace="ITU709"))
            )
        container.mux(stream.encode())
    record, _ = take(capture, path)
    picture = images.read_srgb(capture.frames / record["frames"][0]["name"])
    assert np.abs(picture.mean((0, 1)) - shown[0].mean((0, 1)) / 255).max() < 0.01


def test_hdr_signal_is_brought_into_range():
    ramp = np.linspace(0, 1, 50, dtype=np.float32)[:, None].repeat(3, 1)
    srgb = to_srgb(ramp, HLG, 9)
    assert srgb.min() >= 0 and srgb.max() <= 1 and (np.diff(srgb[:, 0]) > 0).all()
    assert 0.9 < to_srgb(np.full((1, 3), 0.75, np.float32), HLG, 9)[0, 0] < 0.98  # diffuse white is nearly white


def test_photographs_upright_with_focal_length(capture, tmp_path):
    folder = tmp_path / "photos d'été"
    folder.mkdir()
    for i, suffix in enumerate(("jpg", "png", "tif")):
        images.write_srgb(folder / f"b{i}.{suffix}", moving_face(5 * i).astype(np.float32) / 255)
    # shown after a turn clockwise: orientation 6
    turned = np.ascontiguousarray(np.rot90(moving_face(0)[:, :200], 1)).astype(np.float32) / 255
    spec = oiio.ImageSpec(turned.shape[1], turned.shape[0], 3, "uint8")
    spec.attribute("Orientation", 6)
    spec.attribute("Exif:FocalLengthIn35mmFilm", 27)
    output = oiio.ImageOutput.create(str(folder / "a phone.jpg"))
    assert output.open(str(folder / "a phone.jpg"), spec) and output.write_image(turned)
    output.close()
    (folder / "notes.txt").write_text("not a picture")
    (folder / "c broken.jpg").write_bytes(b"\xff\xd8 broken")
    record, report = take(capture, folder)
    assert record["kind"] == "photographs"
    assert [f["source"] for f in record["frames"]] == ["a phone.jpg", "b0.jpg", "b1.png", "b2.tif"]
    assert [f["video_frame"] for f in record["frames"]] == [0, 1, 2, 3]
    first = record["frames"][0]
    assert images.size(capture.frames / first["name"]) == (200, SIZE) and first["face_box"] is not None
    told = pycolmap.infer_camera_from_image(folder / "a phone.jpg")
    assert told.has_prior_focal_length and record["frames"][1]["focal_px"] is None
    assert first["focal_px"] == pytest.approx(told.mean_focal_length(), rel=1e-3)
    assert all(f["selected"] for f in record["frames"])
    assert "few" in report.figures["expected_quality"]


def test_mirrored_pictures_are_flipped_back(capture, tmp_path):
    source = write_video(tmp_path / "clip.mp4", [moving_face(i) for i in range(4)])
    take(capture, source)
    plain = images.read_srgb(capture.frames / "00002.jpg")
    record, _ = take(capture, source, mirrored=True)
    assert np.abs(images.read_srgb(capture.frames / "00002.jpg")[:, ::-1] - plain).mean() < 0.01
    assert all(f["face_box"] for f in record["frames"])


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


def test_a_cut_off_recording_gives_what_is_there_or_says_so(capture, tmp_path):
    pictures = [moving_face(i) for i in range(40)]
    whole = write_video(tmp_path / "whole.mp4", pictures)
    (tmp_path / "cut.mp4").write_bytes(whole.read_bytes()[:-4000])  # an MP4's index comes last
    assert "cut off" in refused(capture, tmp_path / "cut.mp4").problem
    streamed = write_video(tmp_path / "streamed.mkv", pictures).read_bytes()
    (tmp_path / "cut.mkv").write_bytes(streamed[: len(streamed) // 2])
    record, _ = take(capture, tmp_path / "cut.mkv")
    assert 10 < len(record["frames"]) < 40
    for frame in record["frames"][:-1]:
        assert number_in(images.read_srgb(capture.frames / frame["name"])) == frame["video_frame"]


def test_damage_in_the_middle_does_not_stop_it(capture, tmp_path):
    data = bytearray(write_video(tmp_path / "damaged.mkv", [moving_face(i) for i in range(40)]).read_bytes())
    data[len(data) // 2 : len(data) // 2 + 3000] = bytes(3000)
    (tmp_path / "damaged.mkv").write_bytes(data)
    record, _ = take(capture, tmp_path / "damaged.mkv")
    assert len(record["frames"]) >= 10


def test_bad_sources_end_in_a_sentence(capture, tmp_path):
    assert "No video" in refused(capture, "").problem
    assert "no video" in refused(capture, tmp_path / "gone.mp4").problem.lower()
    (tmp_path / "empty.mp4").touch()
    assert "empty" in refused(capture, tmp_path / "empty.mp4").problem
    (tmp_path / "text.mp4").write_text("This is a shopping list, not a video.\n" * 50)
    assert "no video" in refused(capture, tmp_path / "text.mp4").problem
    (tmp_path / "sound.mp4").write_bytes(bytes(2000))
    refused(capture, tmp_path / "sound.mp4")
    folder = tmp_path / "photos"
    folder.mkdir()
    assert "no photographs" in refused(capture, folder).problem
    (folder / "a.dng").write_bytes(b"raw")
    assert "raw files" in refused(capture, folder).problem
    (folder / "b.avif").write_bytes(b"avif")
    assert "are raw and AVIF files" in refused(capture, folder).problem
    for i in range(2):
        (folder / f"{i}.png").write_bytes(b"cut off while it was copied")
    assert "None of the photographs" in refused(capture, folder).problem


def test_no_face_and_no_motion_are_told(capture, tmp_path):
    rng = np.random.default_rng(0)
    scene = cv2.resize(rng.integers(0, 255, (40, 60, 3), np.uint8), (360, 240), interpolation=cv2.INTER_CUBIC)
    assert (
        "No face"
        in refused(
            capture, write_video(tmp_path / "wall.mp4", [np.ascontiguousarray(scene[:, i : i + 240]) for i in range(6)])
        ).problem
    )
    assert "did not move" in refused(capture, write_video(tmp_path / "still.mp4", [moving_face(0)] * 8)).problem


def test_cancel_keeps_the_old_frames(capture, tmp_path):
    source = write_video(tmp_path / "clip.mp4", [moving_face(i) for i in range(10)])
    take(capture, source, max_frames=5)
    before = sorted(p.name for p in capture.frames.iterdir())
    calls = iter([False] * 4 + [True] * 100)
    with pytest.raises(CancelledError):
        frames.run(capture, from_json({}), Reporter("frames", cancelled=lambda: next(calls)))
    assert sorted(p.name for p in capture.frames.iterdir()) == before
    assert not [p for p in capture.root.iterdir() if p.name.startswith(".")]
