# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Single photographs: what the references score on a sitter whose light is known, and pairs in which one thing
differs."""

import cv2
import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.imaging import images  # noqa: E402
from research.benchmarks.captures.state_captures import landmarks_in_uv  # noqa: E402
from research.benchmarks.delighting import (
    pairs,
    photographs,  # noqa: E402
)
from research.benchmarks.measures.features_kept import BROWS  # noqa: E402
from research.benchmarks.measures.references import BLUR, FLAT, NOTHING, TRUE  # noqa: E402
from research.benchmarks.measures.slopes import slope  # noqa: E402
from research.benchmarks.measures.tone import BEST_PSNR  # noqa: E402

SIZE = 256


@pytest.fixture(scope="module")
def sitter():
    """A drawn face with brows under four ramps of light."""
    points, rng = landmarks_in_uv(SIZE), np.random.default_rng(4)
    albedo = 0.3 * np.exp(0.06 * rng.standard_normal((SIZE, SIZE, 1))) * np.float32([1.2, 0.8, 0.6])
    mask = np.zeros((SIZE, SIZE), np.uint8)
    for outline in BROWS:
        cv2.fillPoly(mask, [np.round(points[list(outline)]).astype(np.int32)], 1)
    albedo = np.where(mask[..., None] > 0, 0.4 * albedo, albedo).astype(np.float32)
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    lights = [np.exp(1.5 * (direction - 0.5))[..., None] for direction in (x, y, 1 - x, 1 - y)]
    face = (np.abs(x - 0.5) < 0.4) & (np.abs(y - 0.5) < 0.45)
    srgb = [images.linear_to_srgb(np.clip(albedo * light, 0, 1)).astype(np.float32) for light in lights]
    return photographs.LightSeries("drawn", srgb, albedo, points, face, [face] * 4)


def test_references_score_what_they_must(sitter, monkeypatch):
    monkeypatch.setitem(photographs.delight.PHOTOGRAPHERS, "network", lambda srgb, settings: (0.8 * srgb, None))
    scores = {answer: people["drawn"] for answer, people in photographs.of_sitters([sitter], "network").items()}
    assert scores[NOTHING]["light_slope"] == pytest.approx(1) and scores[NOTHING]["between_lights"] == pytest.approx(1)
    assert scores[NOTHING]["kept_brows"] == pytest.approx(1, abs=0.15)
    assert scores[FLAT]["light_slope"] == pytest.approx(0, abs=1e-6) and scores[FLAT]["agreement"] == BEST_PSNR
    assert scores[FLAT]["kept_brows"] == pytest.approx(0, abs=1e-4) and scores[FLAT]["detail"] == 0
    assert (
        scores[TRUE]["psnr"] == BEST_PSNR
        and scores[TRUE]["lost"] == pytest.approx(0, abs=1e-6)
        and scores[TRUE]["light_slope"] == 0
    )
    assert (
        0 < scores[BLUR]["light_slope"] < 0.3
        and 0 < scores[BLUR]["kept_brows"] < 0.8
        and scores[BLUR]["agreement"] > scores[NOTHING]["agreement"] + 6
    )
    assert scores["network"]["light_slope"] == pytest.approx(1, abs=0.1), "an answer that keeps the light"


def test_in_a_pair_one_thing_differs():
    pigment, light = pairs.pairs({"any": [9100]}, 128)
    assert (pigment.kind, light.kind) == ("pigment", "light") and pigment.group == "any"
    assert (light.albedos[0] == light.albedos[1]).all() and not (pigment.albedos[0] == pigment.albedos[1]).all()
    linear = [tuple(images.srgb_to_linear(srgb) for srgb in pair.pictures) for pair in (pigment, light)]
    assert slope(linear[0], pigment.albedos, pigment.where) > 0.6, "the picture follows the pigment"
    assert slope(pigment.albedos, pigment.albedos, pigment.where) == pytest.approx(1)
    assert slope(light.albedos, linear[1], light.where) == 0
    assert slope(linear[1], linear[1], light.where) == pytest.approx(1)
