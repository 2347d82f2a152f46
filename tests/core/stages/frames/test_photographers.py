# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs as photographers and telephones make them: large, as HEIC, and in colours other than sRGB's."""

import struct

import cv2
import numpy as np
import pytest

from core.capture.capture import Capture
from core.imaging import images
from core.stages.frames.colour import to_srgb
from tests.core.stages.frames.test_frames import SIZE, capture, moving_face, refused, take  # noqa: F401


def test_photographs_are_kept_larger_for_the_features_cameras_are_found_by(capture, tmp_path):  # noqa: F811
    folder = tmp_path / "photos"
    folder.mkdir()
    for i in range(3):
        large = cv2.resize(moving_face(5 * i), (2400, 2400) if i else (300, 300), interpolation=cv2.INTER_CUBIC)
        images.write_srgb(folder / f"{i}.jpg", large.astype(np.float32) / 255)
    record, _ = take(capture, folder, long_side=320, mirrored=True)
    names = [frame["name"] for frame in record["frames"]]
    assert [images.size(capture.frames / name) for name in names] == [(300, 300), (320, 320), (320, 320)]
    assert sorted(path.name for path in (capture.frames / "full").iterdir()) == names[1:], "none is enlarged"
    for name in names[1:]:
        full = images.read_srgb(capture.frames / "full" / name)
        assert full.shape == (2000, 2000, 3)
        assert (
            np.abs(
                cv2.resize(full, (320, 320), interpolation=cv2.INTER_AREA) - images.read_srgb(capture.frames / name)
            ).mean()
            < 0.02
        )


def test_a_telephones_heic_is_read_upright_with_its_focal_length_and_colours(capture, tmp_path):  # noqa: F811
    heif = pytest.importorskip("pillow_heif")
    folder = tmp_path / "photos"
    folder.mkdir()
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
    for i in range(3):
        picture = heif.from_bytes(mode="RGB", size=(SIZE, SIZE), data=moving_face(5 * i).tobytes())
        picture.save(folder / f"{i}.heic", quality=90, exif=exif)
    record, _ = take(capture, folder)
    first = images.read_srgb(capture.frames / record["frames"][0]["name"])
    assert np.abs(first - moving_face(0) / 255).mean() < 0.02
    assert record["frames"][0]["focal_px"] == pytest.approx(6.8 / 8 * SIZE, rel=0.01)
    for i in range(3):
        (folder / f"{i}.heic").write_bytes(b"heic")
    assert "None of the photographs" in refused(Capture(tmp_path / "b.wildcap"), folder).problem


def test_what_cannot_be_read_is_named_with_what_to_do(capture, tmp_path):  # noqa: F811
    folder = tmp_path / "photos"
    folder.mkdir()
    for i in range(3):
        images.write_srgb(folder / f"{i}.jpg", moving_face(5 * i).astype(np.float32) / 255)
    (folder / "cut.heic").write_bytes(b"heic")
    (folder / "from the web.avif").write_bytes(b"avif")
    record, report = take(capture, folder)
    other, finding = report.findings[:2]
    assert len(record["frames"]) == 3
    assert finding["problem"] == "1 of 4 photographs could not be read: cut.heic."
    assert finding["remedy"].startswith("Export it as JPEG or PNG")
    assert other["problem"].startswith("1 AVIF files were left out beside 4") and "JPEG" in other["remedy"]


def give_profile(path, name: str) -> None:
    """As iPhones and cameras write it: the profile is in the JPEG's second application segment."""
    text = name.encode() + b"\0"
    tag = b"desc" + bytes(4) + struct.pack(">I", len(text)) + text + bytes(78 + -(90 + len(text)) % 4)
    head = struct.pack(
        ">I4xI4s4s4s12x4s28x3I48x",
        144 + len(tag),
        0x02100000,
        b"mntr",
        b"RGB ",
        b"XYZ ",
        b"acsp",
        0xF6D6,
        0x10000,
        0xD32D,
    )
    profile = b"ICC_PROFILE\0\1\1" + head + struct.pack(">I4s2I", 1, b"desc", 144, len(tag)) + tag
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xe2" + struct.pack(">H", len(profile) + 2) + profile + data[2:])


def photographed(folder, profiles) -> list[np.ndarray]:
    """A photograph for each profile (None: without); what is stored in them, sRGB."""
    folder.mkdir()
    stored = [moving_face(5 * i).astype(np.float32) / 255 for i in range(len(profiles))]
    for i, (picture, profile) in enumerate(zip(stored, profiles, strict=True)):
        images.write_srgb(folder / f"{i}.jpg", picture, quality=98)
        if profile:
            give_profile(folder / f"{i}.jpg", profile)
    return stored


def test_display_p3_photographs_are_brought_to_srgb(capture, tmp_path):  # noqa: F811
    stored = photographed(tmp_path / "photos", (None, "Display P3", "Display P3"))
    (tmp_path / "photos" / "3.dng").write_bytes(b"raw")
    record, report = take(capture, tmp_path / "photos")
    assert "1 raw files were left out beside 3" in report.findings[0]["problem"]
    plain, wide = (images.read_srgb(capture.frames / record["frames"][i]["name"]) for i in (0, 1))
    assert np.abs(plain - stored[0]).mean() < 0.01
    assert np.abs(wide - stored[1]).mean() > 0.005 and np.abs(wide - to_srgb(stored[1], 1, 12)).mean() < 0.01


def to_xyz(primaries) -> np.ndarray:
    """Linear R, G, B of these primaries, white D65, to XYZ, from their chromaticities."""
    x, y = np.array([*primaries, (0.3127, 0.3290)]).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


def test_adobe_rgb_is_brought_to_srgb_and_other_profiles_are_named(capture, tmp_path):  # noqa: F811
    stored = photographed(tmp_path / "photos", ("Adobe RGB (1998)", "ProPhoto RGB", "sRGB IEC61966-2.1"))
    record, report = take(capture, tmp_path / "photos")
    adobe, other, plain = (images.read_srgb(capture.frames / frame["name"]) for frame in record["frames"])
    linear = (
        stored[0] ** 2.2
        @ np.linalg.solve(
            to_xyz(((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))), to_xyz(((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)))
        ).T
    )
    coarse = [images.resize(each, 24, 24) for each in (adobe, images.linear_to_srgb(linear), stored[0])]
    off, untouched = (np.abs(coarse[i] - coarse[1]) for i in (0, 2))
    assert off.mean() < 0.003 and untouched.mean() > 0.008, "of what a JPEG keeps"
    assert max(np.abs(other - stored[1]).mean(), np.abs(plain - stored[2]).mean()) < 0.01
    told = [finding["problem"] for finding in report.findings if "sRGB" in finding["problem"]]
    assert told == ["The colours of 1.jpg are taken for sRGB, and their profile is ProPhoto RGB."]
