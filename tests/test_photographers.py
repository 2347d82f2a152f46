# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs as photographers and telephones make them: large, and as HEIC."""

import struct

import cv2
import numpy as np
import pytest

from core.contract.capture import Capture
from core.imaging import images

from .test_frames import SIZE, capture, moving_face, refused, take  # noqa: F401


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
        assert np.abs(cv2.resize(full, (320, 320), interpolation=cv2.INTER_AREA)
                      - images.read_srgb(capture.frames / name)).mean() < 0.02


def test_a_telephones_heic_is_read_upright_with_its_focal_length_and_colours(capture, tmp_path):  # noqa: F811
    heif = pytest.importorskip("pillow_heif")
    folder = tmp_path / "photos"
    folder.mkdir()
    rationals = 26 + 2 + 3 * 12 + 4  # behind the two folders of tags
    tags = (struct.pack(">HHII", 0x920A, 5, 1, rationals) + struct.pack(">HHII", 0xA20E, 5, 1, rationals + 8)
            + struct.pack(">HHIHH", 0xA210, 3, 1, 3, 0))
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
