# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of albedo on maps whose answers are known beforehand: the light taken out, agreement, parts, calibration."""

import math

import numpy as np
import pytest

from core.imaging import images
from core.light.spherical_harmonics import sh_basis
from research.benchmarks.measures.agreement import agreement
from research.benchmarks.measures.calibration import calibrate
from research.benchmarks.measures.parts import score_parts
from research.benchmarks.measures.references import blur_divided_out, face_height, flat_colour
from research.benchmarks.measures.shared_light import fit_light, log_ratio, without_light
from research.benchmarks.measures.tone import BEST_PSNR, psnr_after_gain, to_tone

RNG = np.random.default_rng(5)
N = 4000


def unit(n: int = N) -> np.ndarray:
    """Normals [n, 3] of the half of a head that faces -Y."""
    v = RNG.normal(size=(n, 3))
    v[:, 1] = -np.abs(v[:, 1])
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def skin(n: int = N) -> np.ndarray:
    return (
        np.float64([0.45, 0.28, 0.2]) * np.exp(0.15 * RNG.normal(size=(n, 1)) + 0.03 * RNG.normal(size=(n, 3)))
    ).clip(0.01, 0.9)


NORMALS, TRUE, LIGHT = unit(), skin(), 0.1 * RNG.normal(size=9)
SHADING = np.exp(sh_basis(NORMALS) @ LIGHT)[:, None]


def test_a_light_that_all_captures_share_is_no_error():
    answers = [0.7 * TRUE * SHADING, 1.3 * TRUE * SHADING]
    light = fit_light([log_ratio(a, TRUE) for a in answers], [NORMALS] * 2)
    assert light.coefficients[1:] == pytest.approx(LIGHT[1:], abs=1e-6)
    assert light.deviation == pytest.approx(np.log(SHADING).std(), rel=1e-4)
    assert psnr_after_gain(answers[0], TRUE) < 40
    assert all(psnr_after_gain(without_light(a, NORMALS, light), TRUE) == BEST_PSNR for a in answers)


def test_what_differs_between_captures_stays_an_error():
    """Opposite lights cancel: nothing is taken out jointly, where the fit of each capture takes all."""
    answers = [TRUE * SHADING, TRUE / SHADING]
    ratios = [log_ratio(a, TRUE) for a in answers]
    together, alone = fit_light(ratios, [NORMALS] * 2), [fit_light([r], [NORMALS]) for r in ratios]
    assert together.deviation < 1e-3
    lit = psnr_after_gain(answers[0], TRUE)
    assert psnr_after_gain(without_light(answers[0], NORMALS, together), TRUE) == pytest.approx(lit, abs=0.05)
    assert all(
        psnr_after_gain(without_light(a, NORMALS, light), TRUE) == BEST_PSNR
        for a, light in zip(answers, alone, strict=True)
    )


def test_a_shadow_that_was_left_in_does_not_bend_the_light():
    shadow = np.where(RNG.random(N) < 0.12, 0.4, 1.0)[:, None]
    light = fit_light([log_ratio(TRUE * SHADING * shadow * np.exp(0.01 * RNG.normal(size=(N, 1))), TRUE)], [NORMALS])
    assert light.coefficients[1:] == pytest.approx(LIGHT[1:], abs=0.02)


def test_answers_that_are_one_but_for_a_gain_agree_and_a_step_of_a_tenth_is_twenty_decibels():
    tone = TRUE.mean(0)
    assert agreement([TRUE, TRUE * [0.5, 0.7, 1.2]], tone) == BEST_PSNR
    linear = images.srgb_to_linear(np.repeat([[0.5], [0.6], [0.6], [0.5]], 3, 1))
    assert agreement([linear, linear[::-1].copy()], linear.mean(0)) == BEST_PSNR
    assert agreement([linear, linear[[1, 0, 3, 2]]], linear.mean(0)) == pytest.approx(20, abs=1e-3)
    assert agreement([TRUE], tone) is None


def test_parts_share_the_gain_of_the_face():
    brows = np.arange(N) < 500
    answer = np.where(brows[:, None], TRUE * 1.5, TRUE)
    found = score_parts(
        to_tone(answer, TRUE.mean(0) * 3), TRUE, {"brows": brows, "skin": ~brows, "lips": np.arange(N) < 5}
    )
    assert set(found) == {"brows", "skin"} and found["brows"].texels == 500
    assert (
        found["brows"].bias - found["skin"].bias == pytest.approx(np.log(1.5), abs=1e-3)
        and found["brows"].psnr < found["skin"].psnr
    )
    assert found["brows"].deviation < 0.05


def test_a_true_sigma_covers_two_thirds_and_beats_a_constant():
    sigma = np.exp(RNG.normal(-2, 0.7, 200_000))
    error = sigma * RNG.normal(size=sigma.shape)
    found = calibrate(error, sigma)
    assert found.coverage == pytest.approx(0.6827, abs=0.005)
    assert found.likelihood == pytest.approx(-2 + 0.5 + math.log(2 * math.pi) / 2, abs=0.01)
    # log rms less mean log sigma
    assert found.gained == pytest.approx(np.log(np.sqrt((sigma**2).mean())) + 2, abs=0.02)
    assert calibrate(error, sigma / 3).coverage < 0.3 and calibrate(error, sigma / 3).gained < 0


def test_reference_answers():
    where = np.zeros((120, 100), bool)
    where[10:110, 10:90] = True
    ramp = np.linspace(0.1, 0.4, 120)[:, None, None] * np.ones((120, 100, 3))
    assert face_height(where) == 100
    flat = flat_colour(ramp, where)
    assert flat.std((0, 1)) == pytest.approx(0, abs=1e-6) and flat[0, 0] == pytest.approx(ramp[where].mean(0))
    out = blur_divided_out(ramp, where)
    assert np.ptp(out[20:100, 20:80]) < 0.02 < 0.1 < np.ptp(ramp[20:100, 20:80]), "a slow ramp goes"
    moles = ramp.copy()
    moles[60, 50] *= 0.5
    assert blur_divided_out(moles, where)[60, 50, 1] / out[60, 50, 1] == pytest.approx(0.5, abs=0.03), "a mole stays"
