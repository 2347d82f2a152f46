# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contrast of brows, eyes, lips and chin on drawn faces, and the two slopes that tell skin from light."""

import importlib.util
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from core.face import template
from core.geometry.raster import interpolate
from core.imaging import images
from research.benchmarks.measures.features_kept import BROWS, contrast_kept, contrasts, joint
from research.benchmarks.measures.slopes import slope

SHARED = Path(__file__).resolve().parents[5] / "shared"
FACEOLAT, EVALUATE = SHARED / "data" / "faceolat", SHARED / "evaluate" / "feature_contrast.py"
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


def measured(points, linear) -> dict:
    return contrasts(images.linear_to_srgb(linear), points, np.ones((SIZE, SIZE), bool))


def test_a_contrast_is_the_logarithm_of_skin_over_feature(points):
    found = measured(points, drawn(points, 0.5))
    assert found["brows"] == pytest.approx(np.log(2), abs=1e-3) and found["lips"] == pytest.approx(0, abs=1e-3)
    assert found["eyes"] == pytest.approx(0, abs=1e-3) and found["chin"] == pytest.approx(0, abs=1e-3)


def test_a_gain_changes_nothing_and_a_square_root_halves(points):
    truth = measured(points, drawn(points, 0.4))
    assert contrast_kept(measured(points, 0.3 * drawn(points, 0.4)), truth) == pytest.approx({"brows": 1.0}, abs=1e-3)
    assert contrast_kept(measured(points, np.sqrt(drawn(points, 0.4))), truth)["brows"] == pytest.approx(0.5, abs=1e-3)
    assert contrast_kept(measured(points, drawn(points, 1.0)), truth)["brows"] == pytest.approx(0, abs=1e-3)


def test_what_is_not_seen_has_no_contrast(points):
    face = np.zeros((SIZE, SIZE), bool)
    found = contrasts(images.linear_to_srgb(drawn(points, 0.5)), points, face)
    assert set(found.values()) == {None} and contrast_kept(found, measured(points, drawn(points, 0.5))) == {}


def test_jointly_a_bleached_face_loses_all_and_the_pictures_themselves_keep_their_light():
    filmed = [{"brows": 1.2, "eyes": 1.0, "lips": 3.0}, {"brows": 0.8, "eyes": 1.0}]
    assert joint(filmed, filmed) == pytest.approx({"lost": 0.1, "between_lights": 1.0})
    assert joint([{"brows": 0.0, "eyes": 0.0}] * 2, filmed) == pytest.approx({"lost": 1.0, "between_lights": 0.0})
    halved = [{"brows": 1.1, "eyes": 1.0}, {"brows": 0.9, "eyes": 1.0}]
    assert joint(halved, filmed) == pytest.approx({"lost": 0.05, "between_lights": 0.5})
    assert joint(filmed[:1], filmed[:1])["between_lights"] is None
    assert joint([{}], [{}]) == {"lost": None, "between_lights": None}


def test_a_face_that_was_measured_elsewhere_has_the_same_contrasts():
    if not (FACEOLAT.is_dir() and EVALUATE.is_file()):
        pytest.skip("the light stage's photographs and their measure are not at hand")
    spec = importlib.util.spec_from_file_location("feature_contrast", EVALUATE)
    theirs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(theirs)
    for name, landmarks in json.loads((FACEOLAT / "landmarks.json").read_text()).items():
        landmarks, (person, camera) = np.array(landmarks, float), name.split("_")
        face = images.read_mask(FACEOLAT / "align_mask_face" / f"{name}.png") > 127 / 255 + 1e-3
        for path in (
            FACEOLAT / "align_diffuse" / f"{name}.png",
            next(iter(sorted((FACEOLAT / "align_image" / person / camera).glob("*.png")))),
        ):
            srgb = images.read_srgb(path)
            wanted = theirs.contrasts(srgb.astype(np.float64), landmarks, face)
            assert contrasts(srgb, landmarks, face) == pytest.approx(wanted, abs=1e-4)


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


def test_an_answer_that_mixes_both_by_half_has_slopes_of_a_half():
    albedo, light, other = 0.3 * field(0.2), field(0.3), field(0.3)
    answers = tuple(albedo * np.sqrt(each) for each in (light, other))
    assert slope(answers, (albedo * light, albedo * other), HERE) == pytest.approx(0.5)


def test_a_gain_and_pixels_that_are_not_asked_for_change_nothing():
    albedo, light, other = 0.3 * field(0.2), field(0.3), field(0.3)
    inside = HERE.copy()
    inside[:20] = False
    spoilt = np.where(inside[..., None], albedo * other, 5.0)
    assert slope((albedo * light, spoilt * [2, 3, 4]), (albedo * light, albedo * other), inside) == pytest.approx(1)
    assert slope((albedo, albedo), (albedo, 2 * albedo), HERE) is None, "nothing differs but a gain"
