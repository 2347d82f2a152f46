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

from core.capture.messages import Reporter
from core.imaging import images
from core.stages.frames.colour import to_srgb
from core.stages.frames.photographs import read_photographs
from tests.fixtures.moving_face import SIZE, moving_face, refused, take

FACES = [moving_face(5 * i).astype(np.float32) / 255 for i in range(3)]


def read(folder, report: Reporter | None = None, long_side: int = 960) -> list:
    return list(read_photographs(folder, 300, long_side, report or Reporter("frames")))


def test_photographs_of_all_kinds_are_read_upright_with_their_focal_lengths(capture, folder):
    for picture, name in zip(FACES[:2], ("b0.jpg", "b1.png"), strict=True):
        images.write_srgb(folder / name, picture)
    spec = oiio.ImageSpec(SIZE, 200, 3, "uint8")
    spec.attribute("Orientation", 6)  # shown after a turn clockwise
    spec.attribute("Exif:FocalLengthIn35mmFilm", 27)
    output = oiio.ImageOutput.create(str(folder / "a phone.jpg"))
    assert output.open(str(folder / "a phone.jpg"), spec)
    output.write_image(np.ascontiguousarray(np.rot90(FACES[0][:, :200], 1)))
    output.close()
    (folder / "notes.txt").write_text("not a picture")
    (folder / "cut.heic").write_bytes(b"heic")
    (folder / "from the web.avif").write_bytes(b"avif")
    (folder / "d.dng").write_bytes(b"raw")
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
    assert kinds.startswith("2 raw and AVIF files") and "cut.heic" in unreadable


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
    rationals = 26 + 2 + 3 * 12 + 4  # behind the two folders of tags
    tags = (
        struct.pack(">HHII", 0x920A, 5, 1, rationals)
        + struct.pack(">HHII", 0xA20E, 5, 1, rationals + 8)
        + struct.pack(">HHIHH", 0xA210, 3, 1, 3, 0)
    )
    header = b"Exif\0\0MM\0*" + struct.pack(">IHHHIII", 8, 1, 0x8769, 4, 1, 26, 0)
    exif = header + struct.pack(">H", 3) + tags + bytes(4)
    # a lens of 6.8 mm, and 300 pixels a centimetre: a sensor of SIZE pixels is 8 mm wide
    exif += struct.pack(">4I", 68, 10, 300, 1)
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
