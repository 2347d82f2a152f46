# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Damage that a JPEG's decoder does not notice, told from pictures as they are."""

import io
import random

import cv2
import numpy as np
import pytest
from skimage import data

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("OpenImageIO")

from core.imaging import images, jpeg_damage  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402

PICTURES = {name: getattr(data, name)() for name in ("astronaut", "chelsea", "coffee")}
WAYS = (
    {"quality": 95},
    {"quality": 60},
    {"quality": 25},
    {"quality": 90, "subsampling": 0},
    {"quality": 85, "progressive": True},
)


def encoded(picture: np.ndarray, **options) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", **options)
    return file.getvalue()


@pytest.mark.parametrize("options", WAYS)
@pytest.mark.parametrize("name", PICTURES)
def test_sound_pictures_are_read_whatever_they_show(tmp_path, name, options):
    framed = np.pad(PICTURES[name], ((64, 96), (0, 0), (0, 0)), constant_values=16)  # a letterbox along the blocks
    captioned = PICTURES[name].copy()
    captioned[256:304, 64:] = 255
    for picture in (PICTURES[name], framed, captioned):
        (tmp_path / "a.jpg").write_bytes(encoded(picture, **options))
        images.read_stored(tmp_path / "a.jpg", thorough=True)


def test_two_thirds_of_the_wrong_bits_that_show_are_noticed(tmp_path):
    rng, found = random.Random(0), []
    for picture in PICTURES.values():
        sound = encoded(picture, quality=90)
        (tmp_path / "a.jpg").write_bytes(sound)
        clean, start = images.read_srgb(tmp_path / "a.jpg"), sound.index(b"\xff\xda") + 14
        for _ in range(25):
            content = bytearray(sound)
            content[rng.randrange(start, len(content) - 2)] ^= 1 << rng.randrange(8)
            (tmp_path / "a.jpg").write_bytes(content)
            try:
                spoilt = images.read_srgb(tmp_path / "a.jpg")
            except Exception:  # the decoder noticed
                continue
            if 255 * np.abs(spoilt - clean).mean() > 3:
                found.append(jpeg_damage.is_damaged(spoilt, tmp_path / "a.jpg"))
    assert len(found) > 10 and np.mean(found) > 0.6


def test_a_picture_displaced_from_its_first_row_on_is_noticed_and_one_between_bars_is_not(tmp_path):
    rows = PICTURES["astronaut"].reshape(32, 16, 512, 3)
    blocks = rows.swapaxes(1, 2).reshape(-1, 16, 16, 3)  # in the order in which a JPEG stores them, turned
    displaced = np.roll(blocks, 5, 0).reshape(32, 512, 16, 3).swapaxes(1, 2).reshape(512, 512, 3)
    (tmp_path / "a.jpg").write_bytes(encoded(displaced, quality=90))
    assert jpeg_damage.is_displaced(images.read_srgb(tmp_path / "a.jpg"), tmp_path / "a.jpg")
    barred = np.pad(PICTURES["astronaut"], ((0, 0), (64, 64), (0, 0)), constant_values=16)
    (tmp_path / "a.jpg").write_bytes(encoded(barred, quality=90))
    assert not jpeg_damage.is_damaged(images.read_srgb(tmp_path / "a.jpg"), tmp_path / "a.jpg")


@pytest.mark.parametrize("optimize", [False, True])
def test_a_picture_of_one_colour_has_no_hole(tmp_path, optimize):
    white = np.full((512, 512, 3), 255, np.uint8)
    white[200:300, 200:300] = PICTURES["astronaut"][:100, :100]
    (tmp_path / "a.jpg").write_bytes(encoded(white, quality=90, optimize=optimize))
    assert not jpeg_damage.has_hole(tmp_path / "a.jpg")


def test_a_hole_of_zeros_is_refused_by_name(tmp_path):
    sound = encoded(PICTURES["astronaut"], quality=92)
    start = len(sound) // 2
    (tmp_path / "hole.jpg").write_bytes(sound[:start] + bytes(2048) + sound[start + 2048 :])
    refused(lambda: images.read_stored(tmp_path / "hole.jpg", thorough=True), "hole.jpg")


@pytest.mark.parametrize(("sampling", "size"), [(0, (8, 8)), (1, (16, 8)), (2, (16, 16))])
def test_the_size_of_a_block_is_the_headers(tmp_path, sampling, size):
    (tmp_path / "a.jpg").write_bytes(encoded(PICTURES["chelsea"], subsampling=sampling))
    assert jpeg_damage.block_size(tmp_path / "a.jpg") == size
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff")
    assert jpeg_damage.block_size(tmp_path / "a.jpg") == (8, 8)


def test_a_shift_that_begins_with_a_row_is_noticed_and_an_edge_between_two_pictures_is_not(tmp_path):
    rng = np.random.default_rng(3)
    texture = cv2.GaussianBlur(rng.normal(0, 1, (320, 240)).astype(np.float32), (0, 0), 2)
    upper = np.repeat((0.45 + 0.4 * texture)[..., None], 3, 2)
    shifted, other = upper.copy(), upper.copy()
    shifted[160:] += 0.1
    other[160:] = 0.1 + np.roll(upper, 97, axis=1)[160:]
    found = []
    for picture in (upper, shifted, other):
        images.write_srgb(tmp_path / "a.jpg", picture.clip(0, 1), quality=95)
        found.append(jpeg_damage.is_damaged(images.read_srgb(tmp_path / "a.jpg"), tmp_path / "a.jpg"))
    assert found == [False, True, False]
