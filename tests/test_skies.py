# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What environments are like: panoramas whose harmonics are known, and points whose number is."""

import numpy as np
import pytest

from benchmarks.skies import count_independent, sky_shares, summarise_skies
from core.light import sunlight
from core.light.spherical_harmonics import sh_basis
from core.synthetic.environments import panorama_directions, solid_angles, without_lamp

DIRECTIONS = panorama_directions(64, 128)


def grey(luminance: np.ndarray) -> np.ndarray:
    return np.repeat(luminance[..., None], 3, -1)


def test_the_shares_of_a_sky_over_black_ground_are_known():
    shares = sky_shares(grey((DIRECTIONS[..., 2] > 0).astype(float)))
    expected = np.zeros(9)
    expected[[0, 2]] = 1, np.sqrt(3) / 2
    assert np.allclose(shares, expected, atol=5e-3)


def lamp_share(panorama: np.ndarray) -> float:
    """How far a panorama is from even with its lamp in it."""
    whole = np.einsum("ijk,ij->k", sh_basis(DIRECTIONS), panorama.mean(-1) * solid_angles(*panorama.shape[:2]))
    return float(np.linalg.norm(whole[1:] / whole[0]))


def test_a_lamp_is_no_part_of_a_sky():
    towards = DIRECTIONS[20, 90]
    lit = grey(1.0 + 400.0 * (DIRECTIONS @ towards > np.cos(0.05)))
    left, lamp, colour = without_lamp(lit)
    assert lamp @ towards > 0.999 and colour.min() > 0.5
    assert left.max() < lit.max() / 4 and left.min() == 1
    assert np.linalg.norm(sky_shares(lit)[1:]) < 0.3 * lamp_share(lit)


def test_skies_count_as_turned_by_any_angle():
    basis = sh_basis(DIRECTIONS)
    sky = [sky_shares(grey(1 + 0.5 * basis[..., 2] + basis[..., [1, 3]] @ (np.cos(a), np.sin(a)) * 0.3))
           for a in np.arange(8) * np.pi / 4]
    mean, deviation = summarise_skies(np.array(sky[:1]))
    around, spread = summarise_skies(np.array(sky))
    assert np.allclose(mean, around, atol=1e-3) and np.allclose(deviation, spread, atol=1e-3)
    assert mean[2] > 0.1 and deviation[2] < 1e-3 and deviation[1] == pytest.approx(deviation[3]) and deviation[1] > 0.05


def test_points_that_are_far_apart_are_samples_of_their_own():
    points = np.repeat(np.arange(7.0)[:, None] * [1, 0, 0], 50, 0)
    assert count_independent(points, np.ones(350), 0.01) == pytest.approx(7)
    assert count_independent(points, np.ones(350), 1e6) == pytest.approx(1, abs=1e-3)


def test_the_fit_expects_the_sky_above():
    """Of all environments of one mean the expected one is the likeliest, and one of a dark sky is far off."""
    expected = np.eye(9)[0] + sunlight.SKY_MEAN
    upside_down = np.eye(9)[0] - sunlight.SKY_MEAN
    precision = sunlight._SKY_PRECISION
    assert expected @ precision @ expected == pytest.approx(0, abs=1e-9)
    assert upside_down @ precision @ upside_down * sunlight.UNIFORM ** 2 == pytest.approx(
        (2 * 0.41 / 0.29) ** 2 + (2 * 0.11 / 0.40) ** 2)
