# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The measure itself: pictures whose scores are known beforehand."""

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.capture.capture import Capture  # noqa: E402
from core.imaging import images  # noqa: E402
from research.benchmarks.maps import albedo_score  # noqa: E402
from research.benchmarks.maps.albedo_score import AlbedoTruth, compare  # noqa: E402


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


def test_a_map_finer_than_a_pixel_is_averaged_in_linear_light(tmp_path, monkeypatch):
    """Texels of 0.1 and 0.5 in turns are a grey of 0.3 to a pixel that shows four of them, whichever lies in its
    middle."""
    fine = images.linear_to_srgb(np.float32([0.1, 0.5])[np.indices((2048, 2048)).sum(0) % 2])
    images.write_srgb(tmp_path / "maps" / "diffuse_albedo.png", np.repeat(fine[..., None], 3, 2), bits=16)
    monkeypatch.setattr(albedo_score, "looks", lambda capture, truth: ([], []))
    monkeypatch.setattr(albedo_score, "score_map", lambda albedo, looks: {"seen": albedo})
    seen = albedo_score.score_capture(Capture(tmp_path), tmp_path)["seen"]
    assert seen.shape == (1024, 1024, 3)
    assert images.srgb_to_linear(seen[4:-4, 4:-4]) == pytest.approx(0.3, abs=0.005)
    assert albedo_score.averaged(seen) is seen


def test_a_flat_colour_has_no_detail(truth):
    assert compare(np.full_like(truth.albedo, 0.5), truth, truth.face)["detail"] == 0
