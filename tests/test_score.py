# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The measure itself: pictures whose scores are known beforehand."""

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from benchmarks.albedo_score import AlbedoTruth, compare  # noqa: E402
from core.imaging import images  # noqa: E402


@pytest.fixture
def truth():
    rng = np.random.default_rng(0)
    albedo = images.linear_to_srgb(0.3 * np.exp(0.1 * rng.standard_normal((200, 160, 3))))
    face = np.zeros((200, 160), bool)
    face[20:180, 20:140] = True
    shadow = np.zeros_like(face)
    shadow[:, 80:] = True
    return AlbedoTruth(0, albedo, face, shadow)


def test_a_constant_error_of_a_tenth_is_twenty_decibels(truth):
    assert compare(truth.albedo - 0.1, truth, truth.face)["raw"]["psnr"] == pytest.approx(20, abs=1e-3)


def test_a_gain_per_channel_is_free_where_the_score_says_so(truth):
    tinted = images.linear_to_srgb(images.srgb_to_linear(truth.albedo) * np.float32([0.5, 0.8, 0.9]))
    figures = compare(tinted, truth, truth.face)
    assert figures["raw"]["psnr"] < 25 and 50 < figures["gain"]["psnr"]
    assert figures["detail"] == pytest.approx(1, abs=1e-3)


def test_a_baked_shadow_is_a_step_of_its_logarithm(truth):
    shaded = images.srgb_to_linear(truth.albedo) * np.where(truth.shadow, 0.5, 1)[..., None]
    found = compare(images.linear_to_srgb(shaded), truth, truth.face)
    assert found["shadow_step"] == pytest.approx(np.log(2), abs=0.02)


def test_a_flat_colour_has_no_detail(truth):
    assert compare(np.full_like(truth.albedo, 0.5), truth, truth.face)["detail"] == 0
