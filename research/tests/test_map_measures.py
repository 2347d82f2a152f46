# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of maps on drawn pictures: contrast of brows, eyes, lips and chin, the two slopes that tell skin from light,
moles, and the scores of masks."""

import cv2
import numpy as np
import pytest

from core.face import template
from core.geometry.raster import interpolate
from core.imaging import images
from research.benchmarks.delighting.shadow_mask import scores
from research.benchmarks.maps.detail import moles
from research.benchmarks.measures.features_kept import BROWS, contrast_kept, contrasts, joint
from research.benchmarks.measures.slopes import slope

SIZE = 640
SKIN = np.float32([0.40, 0.26, 0.19])


@pytest.fixture(scope="module")
def points():
    """The built-in head's landmarks in its UVs, as pixels of a map."""
    mesh, (face, bary) = template.load(), template.landmarks()
    uv = interpolate(mesh.uvs, mesh.face_uvs, face, bary)
    return np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * SIZE


def drawn(points, brows: float) -> np.ndarray:
    """A face of one colour with brows of so much of it; linear."""
    picture = np.tile(SKIN, (SIZE, SIZE, 1))
    mask = np.zeros((SIZE, SIZE), np.uint8)
    for outline in BROWS:
        cv2.fillPoly(mask, [np.round(points[list(outline)]).astype(np.int32)], 1)
    picture[mask > 0] *= brows
    return picture


def measured(points, linear, face=True) -> dict:
    return contrasts(images.linear_to_srgb(linear), points, np.full((SIZE, SIZE), face))


def test_a_contrast_is_the_logarithm_of_skin_over_feature(points):
    found = measured(points, drawn(points, 0.5))
    assert found == pytest.approx({**dict.fromkeys(found, 0), "brows": np.log(2)}, abs=1e-3)
    assert {"brows", "lips", "eyes", "chin"} <= set(found)


def test_a_gain_changes_no_contrast_a_square_root_halves_it_and_what_is_not_seen_has_none(points):
    picture = drawn(points, 0.4)
    truth = measured(points, picture)
    for answer, kept in ((0.3 * picture, 1.0), (np.sqrt(picture), 0.5), (drawn(points, 1.0), 0.0)):
        assert contrast_kept(measured(points, answer), truth)["brows"] == pytest.approx(kept, abs=1e-3)
    unseen = measured(points, picture, face=False)
    assert set(unseen.values()) == {None} and contrast_kept(unseen, truth) == {}


def test_jointly_a_bleached_face_loses_all_and_the_pictures_themselves_keep_their_light():
    filmed = [{"brows": 1.2, "eyes": 1.0, "lips": 3.0}, {"brows": 0.8, "eyes": 1.0}]
    assert joint(filmed, filmed) == pytest.approx({"lost": 0.1, "between_lights": 1.0})
    assert joint([{"brows": 0.0, "eyes": 0.0}] * 2, filmed) == pytest.approx({"lost": 1.0, "between_lights": 0.0})
    halved = [{"brows": 1.1, "eyes": 1.0}, {"brows": 0.9, "eyes": 1.0}]
    assert joint(halved, filmed) == pytest.approx({"lost": 0.05, "between_lights": 0.5})
    assert joint(filmed[:1], filmed[:1])["between_lights"] is None
    assert joint([{}], [{}]) == {"lost": None, "between_lights": None}


RNG = np.random.default_rng(2)
HERE = np.ones((60, 50), bool)


def field(deviation: float) -> np.ndarray:
    return np.exp(deviation * RNG.normal(size=(60, 50, 1)) + 0.02 * RNG.normal(size=(60, 50, 3)))


def test_doing_nothing_follows_both_and_a_flat_colour_neither():
    albedo, light = 0.3 * field(0.2), field(0.3)
    other_albedo, other_light = albedo * field(0.2), light * field(0.3)
    pigment, lights = (albedo * light, other_albedo * light), (albedo * light, albedo * other_light)
    assert slope(pigment, (albedo, other_albedo), HERE) == pytest.approx(1)
    assert slope(lights, lights, HERE) == pytest.approx(1)
    flat = (np.full((60, 50, 3), 0.3), np.full((60, 50, 3), 0.2))
    assert slope(flat, (albedo, other_albedo), HERE) == pytest.approx(0)
    assert slope(flat, lights, HERE) == pytest.approx(0)
    assert slope((albedo, other_albedo), (albedo, other_albedo), HERE) == 1, "the true light"
    assert slope((albedo, albedo), lights, HERE) == 0
    assert slope((albedo, albedo), (albedo, 2 * albedo), HERE) is None, "nothing differs but a gain"


def test_moles_are_found_where_they_are_and_lines_are_none():
    log = np.zeros((120, 120), np.float32)
    for y, x in ((30, 40), (80, 70)):
        cv2.circle(log, (x, y), 2, -0.5, -1)
    cv2.line(log, (10, 100), (110, 100), -0.5, 2)
    band = cv2.GaussianBlur(log, (0, 0), 1.2) - cv2.GaussianBlur(log, (0, 0), 5.0)
    assert sorted(moles(band, np.ones((120, 120), bool))) == [(30, 40), (80, 70)]


def test_scores_of_masks_with_known_overlap():
    y, x = np.mgrid[0:256, 0:256]
    disc, shifted = (np.hypot(x - middle, y - 128) < 51 for middle in (128, 133))
    half, everywhere = disc & (x < 128), np.ones_like(disc)
    assert scores(disc, disc, everywhere)[2:] == (1, 1, 1, 1)
    assert scores(half, disc, everywhere)[2:5] == pytest.approx((0.5, 1, 0.5), abs=0.02)
    # by 20 texels of a 1024 map: only where the borders cross do they meet
    assert scores(shifted, disc, everywhere)[5] < 0.4
    assert scores(~disc, disc, everywhere)[2:5] == (0, 0, 0)
