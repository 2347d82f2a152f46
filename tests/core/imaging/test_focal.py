# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Focal lengths in EXIF: believed as far as picture and sense bear them out."""

import math

import pytest

from core.imaging import focal
from core.imaging.exif import FOCAL_35MM, FOCAL_LENGTH, HEIGHT, MAKE, PLANE_RESOLUTION, PLANE_UNIT, WIDTH

NAMES = {
    "film": FOCAL_35MM,
    "lens": FOCAL_LENGTH,
    "plane": PLANE_RESOLUTION,
    "unit": PLANE_UNIT,
    "w": WIDTH,
    "h": HEIGHT,
    "make": MAKE,
}
CANON_R6 = {"lens": 50.0, "plane": 5472 / (35.9 / 25.4), "unit": 2, "w": 5472, "h": 3648, "make": "Canon"}
PHONE = {"lens": 6.8, "plane": 4000 / 0.98, "unit": 3, "w": 4000, "h": 3000}
CANON_6D = {"lens": 50.0, "plane": 6673.8, "unit": 2, "w": 6240, "h": 4160, "make": "Canon"}


def read(size: tuple[int, int], **tags) -> focal.Focal:
    return focal.read({NAMES[name]: value for name, value in tags.items()}, *size)


@pytest.mark.parametrize(
    ("size", "tags", "mm35", "source", "deviation"),
    [
        ((3000, 4000), {"film": 27, "lens": 4.2, "w": 4000, "h": 3000}, 27, focal.FILM, 0.03),
        ((480, 640), {"film": 27, "w": 4000, "h": 3000}, 27, focal.FILM, 0.06),  # resized
        ((480, 640), {"film": 85}, 85, focal.FILM, 0.06),
        ((3648, 5472), CANON_R6, 50 * 36 / 35.9, focal.SENSOR, 0.03),
        ((480, 640), {"lens": 50.0, "plane": 2116.7, "unit": 2, "w": 3000, "h": 4000}, 36.06, focal.SENSOR, 0.06),
        ((1067, 1600), CANON_R6, 50 * 36 / 35.9, focal.SENSOR, 0.06),
        ((4000, 3000), PHONE, 6.8 * 43.267 / math.hypot(9.8, 7.35), focal.SENSOR, 0.03),
        ((4000, 3000), {**PHONE, "film": 1}, 6.8 * 43.267 / math.hypot(9.8, 7.35), focal.SENSOR, 0.03),
        ((4000, 3000), {**PHONE, "film": 24, "plane": 100.0}, 24, focal.FILM, 0.03),
        ((4000, 2672), {"film": 50, "w": 3984, "h": 2656}, 50, focal.FILM, 0.03),  # a raw picture's borders
    ],
)
def test_tags_that_fit_the_picture_are_believed(size, tags, mm35, source, deviation):
    told = read(size, **tags)
    assert told.mm35 == pytest.approx(mm35, rel=0.01) and (told.source, told.deviation) == (source, deviation)


@pytest.mark.parametrize(
    ("size", "tags", "words"),
    [
        ((480, 640), {"film": 1, "lens": 3.0}, "no lens for a face"),
        ((480, 640), {"film": 65535}, "no lens for a face"),
        ((480, 640), {"film": -35}, "no lens for a face"),
        ((480, 640), {"film": 300, "lens": 4.2}, "a lens of 4.2 mm"),
        ((480, 640), {"film": 18, "lens": 50.0}, "a lens of 50 mm"),
        ((480, 640), {**CANON_R6, "w": 640, "h": 427}, "cropped"),
        ((533, 800), {**CANON_R6, "w": 800, "h": 533}, "no camera"),  # resized, the size written anew, the sensor not
        ((2000, 3000), {**CANON_R6, "w": 3000, "h": 2000}, "no camera"),
        ((6240, 4160), CANON_6D, "no camera has a sensor of 23.7"),
        ((640, 427), CANON_6D, "no camera"),
        ((480, 640), CANON_6D, "cropped from 6240 x 4160"),
        ((3000, 4000), {"film": 27, "w": 4000, "h": 2250}, "cropped"),
        ((4000, 3000), {**PHONE, "unit": 9}, "no unit"),
        ((4000, 3000), {**PHONE, "lens": 0.4}, "no lens for a face"),
    ],
)
def test_tags_that_contradict_picture_or_sense_are_none(size, tags, words):
    told = read(size, **tags)
    assert told.mm35 is None and words in told.doubt


@pytest.mark.parametrize(
    "tags",
    [
        {},
        {"film": 0},
        {"film": float("nan")},
        {"film": float("inf")},
        {"lens": 50.0},
        {"plane": 5000.0},
        {"plane": float("inf"), "lens": 50.0},
        {"plane": 0, "lens": 0, "film": 0},
        {"film": "50 mm"},
    ],
)
def test_tags_that_say_nothing_are_not_doubted(tags):
    assert read((480, 640), **tags) == focal.Focal()


def test_a_picture_without_pixels_has_no_focal_length():
    assert read((0, 0), film=50).mm35 is None


def test_millimetres_become_pixels_by_the_diagonal_and_back():
    assert focal.to_pixels(43.267, 600, 800) == pytest.approx(1000)
    assert focal.to_film(1000, 600, 800) == pytest.approx(43.267)
