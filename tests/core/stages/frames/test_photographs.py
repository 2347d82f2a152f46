# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs as photographers and telephones make them: of all kinds and sizes, as HEIC, in colours other than
sRGB's."""

import struct

import cv2
import numpy as np
import OpenImageIO as oiio
import pycolmap
import pytest

from core.capture.messages import Problem, Reporter
from core.imaging import images
from core.imaging.colours import of_numbers
from core.stages.frames.colour import from_stated, to_srgb
from core.stages.frames.photographs import read_photographs
from tests.fixtures.moving_face import SIZE, moving_face, refused, take
from tests.fixtures.raw_picture import write_dng

FACES = [moving_face(5 * i).astype(np.float32) / 255 for i in range(3)]


def read(folder, report: Reporter | None = None, long_side: int = 960) -> list:
    return list(read_photographs(folder, 300, long_side, report or Reporter("frames")))


def test_photographs_of_all_kinds_are_read_upright_with_their_focal_lengths(capture, folder):
    for picture, name in zip(FACES[:2], ("b0.jpg", "b1.png"), strict=True):
        images.write_srgb(folder / name, picture)
    spec = oiio.ImageSpec(SIZE, 200, 3, "uint8")
    spec.attribute("Orientation", 6)  # shown after a turn clockwise
    spec.attribute("Exif:FocalLengthIn35mmFilm", 27)
    for name, value in (("ExposureTime", 1 / 60), ("FNumber", 2.0), ("Exif:PhotographicSensitivity", 240)):
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(folder / "a phone.jpg"))
    assert output.open(str(folder / "a phone.jpg"), spec)
    output.write_image(np.ascontiguousarray(np.rot90(FACES[0][:, :200], 1)))
    output.close()
    (folder / "notes.txt").write_text("not a picture")
    (folder / "cut.heic").write_bytes(b"heic")
    (folder / "from the web.avif").write_bytes(b"avif")
    (folder / "d.dng").write_bytes(b"raw")
    (folder / "e").write_bytes(b"GIF89a")
    assert [picture.exposure for picture in read(folder)] == [pytest.approx(0, abs=1e-3), None, None]
    record, report = take(capture, folder)
    assert record["kind"] == "photographs"
    assert [f["source"] for f in record["frames"]] == ["a phone.jpg", "b0.jpg", "b1.png"]
    assert [f["video_frame"] for f in record["frames"]] == [0, 1, 2]
    first = record["frames"][0]
    assert images.size(capture.frames / first["name"]) == (200, SIZE) and first["face_box"] is not None
    told = pycolmap.infer_camera_from_image(folder / "a phone.jpg")
    assert told.has_prior_focal_length and record["frames"][1]["focal_px"] is None
    assert first["focal_px"] == pytest.approx(told.mean_focal_length(), rel=1e-3)
    assert all(f["selected"] for f in record["frames"])
    assert "few" in report.figures["expected_quality"]
    kinds, unreadable = (finding["problem"] for finding in report.findings[:2])
    assert kinds.startswith("2 GIF and AVIF files") and "3 of 7" in kinds
    assert "2 of 5" in unreadable and "cut.heic, d.dng" in unreadable
    assert report.figures["photographs_read"] == "3 of 7"
    assert (first["focal_source"], first["focal_deviation"]) == ("35 mm equivalent", 0.06)


def test_photographs_are_kept_larger_for_the_features_cameras_are_found_by(capture, folder):
    for i, side in enumerate((300, 2400)):
        large = cv2.resize(moving_face(5 * i), (side, side), interpolation=cv2.INTER_CUBIC)
        images.write_srgb(folder / f"{i}.jpg", large.astype(np.float32) / 255)
    record, _ = take(capture, folder, long_side=320, mirrored=True)
    names = [frame["name"] for frame in record["frames"]]
    assert [images.size(capture.frames / name) for name in names] == [(300, 300), (320, 320)]
    assert [path.name for path in (capture.frames / "full").iterdir()] == names[1:], "none is enlarged"
    full = images.read_srgb(capture.frames / "full" / names[1])
    assert full.shape == (2000, 2000, 3)
    for shown in (full, images.read_srgb(capture.frames / names[1])):
        assert np.abs(images.resize(shown, SIZE, SIZE) - FACES[1][:, ::-1]).mean() < 0.02, "flipped back"


def test_a_telephones_heic_is_read_upright_with_its_focal_length_and_colours(capture, folder):
    heif = pytest.importorskip("pillow_heif")
    rationals = 26 + 2 + 5 * 12 + 4  # behind the two folders of tags
    tags = (
        struct.pack(">HHII", 0x920A, 5, 1, rationals)
        + struct.pack(">HHII", 0xA002, 4, 1, 4000)
        + struct.pack(">HHII", 0xA003, 4, 1, 4000)
        + struct.pack(">HHII", 0xA20E, 5, 1, rationals + 8)
        + struct.pack(">HHIHH", 0xA210, 3, 1, 3, 0)
    )
    header = b"Exif\0\0MM\0*" + struct.pack(">IHHHIII", 8, 1, 0x8769, 4, 1, 26, 0)
    exif = header + struct.pack(">H", 5) + tags + bytes(4)
    # a lens of 6.8 mm, and 5000 pixels a centimetre: a sensor of 4000 pixels is 8 mm wide
    exif += struct.pack(">4I", 68, 10, 5000, 1)
    picture = heif.from_bytes(mode="RGB", size=(SIZE, SIZE), data=moving_face(0).tobytes())
    picture.save(folder / "0.heic", quality=90, exif=exif)
    (first,) = read(folder)
    assert np.abs(first.srgb - FACES[0]).mean() < 0.02
    assert first.focal_px == pytest.approx(6.8 / 8 * SIZE, rel=0.01)
    (folder / "0.heic").write_bytes(b"heic")
    refused(capture, folder, "None of the photographs")


def give_profile(path, name: str) -> None:
    """As iPhones and cameras write it: the profile is in the JPEG's second application segment."""
    text = name.encode() + b"\0"
    tag = b"desc" + bytes(4) + struct.pack(">I", len(text)) + text + bytes(78 + -(90 + len(text)) % 4)
    numbers = (b"mntr", b"RGB ", b"XYZ ", b"acsp", 0xF6D6, 0x10000, 0xD32D)
    head = struct.pack(">I4xI4s4s4s12x4s28x3I48x", 144 + len(tag), 0x02100000, *numbers)
    profile = b"ICC_PROFILE\0\1\1" + head + struct.pack(">I4s2I", 1, b"desc", 144, len(tag)) + tag
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xe2" + struct.pack(">H", len(profile) + 2) + profile + data[2:])


def to_xyz(primaries) -> np.ndarray:
    """Linear R, G, B of these primaries, white D65, to XYZ, from their chromaticities."""
    x, y = np.array([*primaries, (0.3127, 0.3290)]).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


@pytest.mark.parametrize("profile", ["", "sRGB IEC61966-2.1", "Display P3", "Adobe RGB (1998)", "ProPhoto RGB"])
def test_wide_colours_are_brought_to_srgb_and_unknown_profiles_are_named(folder, profile):
    images.write_srgb(folder / "0.jpg", FACES[0], quality=98)
    true = FACES[0]
    if profile:
        give_profile(folder / "0.jpg", profile)
    if profile == "Display P3":
        true = to_srgb(FACES[0], 1, 12)
    if profile == "Adobe RGB (1998)":
        adobe, srgb = (to_xyz(((0.64, 0.33), green, (0.15, 0.06))) for green in ((0.21, 0.71), (0.30, 0.60)))
        true = images.linear_to_srgb(FACES[0] ** 2.2 @ np.linalg.solve(srgb, adobe).T)
    report = Reporter("frames")
    (picture,) = read(folder, report)
    coarse = [images.resize(each, 24, 24) for each in (picture.srgb, true, FACES[0])]
    assert np.abs(coarse[0] - coarse[1]).mean() < 0.003, "of what a JPEG keeps"
    assert (np.abs(coarse[2] - coarse[1]).mean() > 0.005) == (profile in ("Display P3", "Adobe RGB (1998)"))
    assert ["ProPhoto RGB" in finding["problem"] for finding in report.findings] == [True] * (profile == "ProPhoto RGB")


def encoded(picture: np.ndarray, suffix: str, *options: int) -> bytes:
    return cv2.imencode(suffix, (picture[..., ::-1] * 255).round().astype(np.uint8), options)[1].tobytes()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("IMG_1.HEIC", lambda: encoded(FACES[0], ".jpg")),
        ("IMG_1.hif", lambda: encoded(FACES[0], ".jpg")),
        ("DSC1.ARW", lambda: encoded(FACES[0], ".jpg")),
        ("a.jfif", lambda: encoded(FACES[0], ".jpg")),
        ("a.png", lambda: encoded(FACES[0], ".webp")),
        ("a.jpg", lambda: encoded(FACES[0], ".png")),
        ("a.JPG", lambda: encoded(FACES[0], ".tiff")),
        ("IMG_1.jpg", "HEIF"),
        ("IMG_1.HIF", "HEIF"),
    ],
)
def test_a_picture_is_read_by_what_it_holds_under_any_name(folder, name, content):
    if content == "HEIF":
        heif = pytest.importorskip("pillow_heif")
        picture = heif.from_bytes(mode="RGB", size=(SIZE, SIZE), data=moving_face(0).tobytes())
        picture.save(folder / "a.heic", quality=90)
        (folder / "a.heic").rename(folder / name)
    else:
        (folder / name).write_bytes(content())
    report = Reporter("frames")
    (picture,) = read(folder, report)
    assert np.abs(picture.srgb - FACES[0]).mean() < 0.02 and not report.findings


@pytest.mark.parametrize(
    "options",
    [
        (),
        (cv2.IMWRITE_JPEG_OPTIMIZE, 1),
        (cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
        (cv2.IMWRITE_JPEG_RST_INTERVAL, 16),
    ],
)
def test_a_jpeg_that_lost_data_before_a_proper_end_is_left_out(folder, options):
    whole = encoded(FACES[0], ".jpg", cv2.IMWRITE_JPEG_QUALITY, 92, *options)
    half = len(whole) // 2
    (folder / "whole.jpg").write_bytes(whole + b"what a phone appends")
    (folder / "padded.jpg").write_bytes(whole[:-2] + bytes(30) + whole[-2:])
    (folder / "half.jpg").write_bytes(whole[:half] + b"\xff\xd9")
    (folder / "zeros.jpg").write_bytes(whole[:half] + bytes(len(whole) - half - 2) + b"\xff\xd9")
    (folder / "gap.jpg").write_bytes(whole[:half] + whole[half + 4096 :])
    report = Reporter("frames")
    assert [picture.source for picture in read(folder, report)] == ["padded.jpg", "whole.jpg"]
    (finding,) = report.findings
    assert finding["problem"] == "3 of 5 photographs could not be read: gap.jpg, half.jpg, zeros.jpg."
    assert "copy it" in finding["remedy"]


def test_raw_photographs_are_developed_in_one_way_with_their_colours(capture, folder):
    pytest.importorskip("rawpy")
    for i in range(3):
        write_dng(folder / f"{i}.DNG", images.srgb_to_linear(FACES[i]), mm35=50)
    write_dng(folder / "turned.dng", images.srgb_to_linear(np.rot90(FACES[0][:200])), orientation=6)
    whole = (folder / "2.DNG").read_bytes()
    (folder / "2.DNG").write_bytes(whole[: len(whole) // 2])
    record, report = take(capture, folder)
    assert [f["source"] for f in record["frames"]] == ["0.DNG", "1.DNG", "turned.dng"]
    assert record["frames"][0]["focal_px"] == pytest.approx(50 / 43.267 * np.hypot(SIZE, SIZE), rel=1e-3)
    assert "camera white balance" in report.figures["raw_development"]
    for f, true in zip(record["frames"], (FACES[0], FACES[1], FACES[0][:200]), strict=True):
        developed = images.read_srgb(capture.frames / f["name"])
        assert np.abs((developed - true).mean((0, 1))).max() < 0.005, "no tint, no other brightness"
        assert np.abs(developed - true).mean() < 0.02


def test_a_photograph_alone_makes_a_draft_and_says_what_more_would_bring(capture, folder):
    for i in range(2):
        images.write_srgb(folder / f"{i}.jpg", FACES[i])
    record, report = take(capture, folder / "1.jpg")
    assert [f["source"] for f in record["frames"]] == ["1.jpg"] and record["kind"] == "photographs"
    draft = report.findings[0]
    assert "only one photograph" in draft["problem"] and "second" in draft["remedy"] and "third" in draft["remedy"]
    images.write_srgb(folder / "1.jpg", np.mgrid[:SIZE, :SIZE].sum(0)[..., None].repeat(3, 2) / (2 * SIZE))
    with pytest.raises(Problem, match="No face was found in 1.jpg"):
        take(capture, folder / "1.jpg")
    (folder / "1.jpg").write_bytes(b"\xff\xd8\xff")
    with pytest.raises(Problem, match="1.jpg could not be read"):
        take(capture, folder / "1.jpg")


def test_a_numbered_sequence_in_acescg_is_a_film_that_keeps_its_colours(capture, folder):
    to_acescg = np.array([[0.6131, 0.3395, 0.0474], [0.0702, 0.9164, 0.0134], [0.0206, 0.1096, 0.8698]], np.float32)
    for i in range(41):
        path = folder / f"plate.{1001 + i}.exr"
        spec = oiio.ImageSpec(SIZE, SIZE, 3, "half")
        spec.attribute("chromaticities", "float[8]", (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767))
        output = oiio.ImageOutput.create(str(path))
        assert output.open(str(path), spec)
        moved = np.roll(images.srgb_to_linear(moving_face(0) / np.float32(255)), i, 1)
        output.write_image(np.ascontiguousarray(moved @ to_acescg.T))
        output.close()
    record, report = take(capture, folder, max_frames=12)
    assert record["kind"] == "video" and len(record["frames"]) <= 12
    assert record["frames"][1]["time_s"] > record["frames"][0]["time_s"] == 0
    assert report.figures["photographs_read"] == "12 of 41"
    assert np.abs(images.read_srgb(capture.frames / "00000.jpg") - FACES[0]).mean() < 0.012


def test_a_rigs_cameras_give_one_picture_each(capture, folder):
    for i, camera in enumerate("abc"):
        for number in range(2):
            (folder / camera).mkdir(exist_ok=True)
            images.write_srgb(folder / camera / f"{number}.png", FACES[i] * (1 if number else 0.5))
    record, _ = take(capture, folder)
    assert [f["source"] for f in record["frames"]] == ["a/1.png", "b/1.png", "c/1.png"]


@pytest.mark.parametrize("transfer", [16, 18])
def test_an_hdr_photograph_shows_what_an_hdr_video_would(transfer):
    signal = np.random.default_rng(0).random((4, 4, 3), np.float32)
    assert np.array_equal(from_stated(signal, of_numbers(9, transfer)), to_srgb(signal, transfer, 9))
