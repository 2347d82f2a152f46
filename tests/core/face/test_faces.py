# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces: found, placed, followed through turns of the picture; nothing found where there is none."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from skimage.data import astronaut

from core.face import faces
from core.imaging import images
from tests.fixtures.refused import refused

PORTRAITS = Path(__file__).resolve().parents[4] / "shared" / "data" / "portraits"


@pytest.fixture(scope="module")
def picture() -> np.ndarray:
    """A woman before a flag: sRGB [512, 512, 3], the face about 110 px high, its eyes near (208, 118) and (244,
    118)."""
    return astronaut().astype(np.float32) / 255


@pytest.fixture(scope="module")
def face(picture) -> faces.Face:
    return faces.detect(picture)


def test_face_and_features_are_where_they_are(face):
    assert face.score > 0.9
    assert 150 < face.box[0] < face.box[2] < 300 and 40 < face.box[1] < face.box[3] < 210
    right, left = (face.landmarks[list(eye), :2].mean(0) for eye in (faces.RIGHT_EYE, faces.LEFT_EYE))
    assert right[0] < face.landmarks[faces.NOSE, 0] < left[0]  # the person's right is at the picture's left
    assert face.landmarks[faces.BROW, 1] < face.landmarks[faces.NOSE, 1] < face.landmarks[faces.CHIN, 1]


@pytest.mark.parametrize("degrees", [-35, 20])
def test_landmarks_turn_with_the_picture(picture, face, degrees):
    turn = cv2.getRotationMatrix2D((224, 120), degrees, 1.0)
    turned = faces.detect(cv2.warpAffine(picture, turn, (512, 512)))
    expected = face.landmarks[:, :2] @ turn[:, :2].T + turn[:, 2]
    off = np.linalg.norm(turned.landmarks[:, :2] - expected, axis=1)
    assert np.median(off) < 0.03 * 110


def test_a_face_that_fills_the_picture_is_found(picture, face):
    close = faces.detect(images.resize(picture[30:220, 140:310], 720, 805))
    expected = (face.landmarks[:, :2] - [140, 30]) * [720 / 170, 805 / 190]
    assert np.median(np.linalg.norm(close.landmarks[:, :2] - expected, axis=1)) < 0.03 * 470


def test_following_a_face_agrees_with_finding_it(picture, face):
    followed = faces.detect(np.roll(picture, (6, 10), (0, 1)), face)
    off = np.linalg.norm(followed.landmarks[:, :2] - face.landmarks[:, :2] - [10, 6], axis=1)
    assert np.median(off) < 2


def test_mirrored_picture_turns_the_other_way(picture, face):
    mirrored = faces.detect(picture[:, ::-1])
    assert abs(face.yaw_deg + mirrored.yaw_deg) < 8 and abs(face.yaw_deg) < 45


def test_what_looks_like_a_face_at_first_does_not_hide_the_one_behind_it(picture, face, monkeypatch):
    """A print on a shirt is more prominent, and its landmarks are none."""
    regions = [(40.0, picture.shape[0] - 40.0, 60.0, 0.0), faces._region_of_landmarks(face.landmarks)]
    assert faces._landmarks(picture, regions[0]) is None
    monkeypatch.setattr(faces, "_detect_regions", lambda image, margin: regions)
    assert np.abs(faces.detect(picture).landmarks - face.landmarks).max() < 0.05 * face.width


def test_no_face_in_noise_or_black():
    noise = np.random.default_rng(0).random((300, 400, 3), dtype=np.float32)
    assert faces.detect(noise) is None
    assert faces.detect(np.zeros((64, 48, 3), np.float32)) is None


def test_person_is_told_from_background(picture):
    mask = faces.segment_person(picture)
    assert mask.shape == (512, 512) and 0 <= mask.min() and mask.max() <= 1
    assert mask[80:160, 200:250].mean() > 0.9 and mask[:60, 400:].mean() < 0.2


def test_an_opencv_that_cannot_read_the_networks_is_named(monkeypatch, picture):
    def refuse(_):
        raise faces.cv2.error("no such operator")

    monkeypatch.setattr(faces.cv2.dnn, "readNetFromTFLite", refuse)
    faces._net.cache_clear()
    try:
        refused(lambda: faces.detect(picture), "face_detection")
    finally:
        faces._net.cache_clear()


def test_portraits_in_the_wild():
    files = sorted(PORTRAITS.glob("*.png"))
    if not files:
        pytest.skip("the portraits are not at hand")
    for path in files[::4]:
        face = faces.detect(images.read_srgb(path))
        assert face is not None and face.score > 0.95 and abs(face.yaw_deg) < 30, path.name
