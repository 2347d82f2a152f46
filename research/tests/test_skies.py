# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What environments are like: panoramas whose harmonics are known, and points whose number is."""

import numpy as np
import pytest

from core.light import sunlight
from core.light.skylight import fibonacci_sphere
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis
from research.benchmarks.light.skies import count_independent, harmonic_shares, summarise_skies
from research.people.environments import panorama_directions, without_lamp

DIRECTIONS = panorama_directions(64, 128)


def grey(luminance: np.ndarray) -> np.ndarray:
    return np.repeat(luminance[..., None], 3, -1)


def test_the_shares_of_a_sky_over_black_ground_are_known():
    shares = harmonic_shares(grey((DIRECTIONS[..., 2] > 0).astype(float)))
    expected = np.zeros(9)
    expected[[0, 2]] = 1, np.sqrt(3) / 2
    assert np.allclose(shares, expected, atol=5e-3)


def test_a_lamp_is_no_part_of_a_sky():
    towards = DIRECTIONS[20, 90]
    lit = grey(1.0 + 400.0 * (DIRECTIONS @ towards > np.cos(0.05)))
    left, lamp, colour = without_lamp(lit)
    assert lamp @ towards > 0.999 and colour.min() > 0.5
    assert left.max() < lit.max() / 4 and left.min() == 1
    with_lamp, without = (np.linalg.norm(harmonic_shares(panorama)[1:]) for panorama in (lit, left))
    assert without < 0.3 * with_lamp


def test_skies_count_as_turned_by_any_angle():
    basis = sh_basis(DIRECTIONS)
    sky = [
        harmonic_shares(grey(1 + 0.5 * basis[..., 2] + basis[..., [1, 3]] @ (np.cos(a), np.sin(a)) * 0.3))
        for a in np.arange(8) * np.pi / 4
    ]
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
    assert upside_down @ precision @ upside_down * sunlight.UNIFORM**2 == pytest.approx(
        (2 * 0.41 / 0.29) ** 2 + (2 * 0.11 / 0.40) ** 2
    )


@pytest.mark.parametrize("above", [0.3, 0.6])
def test_an_overcast_sky_is_found_on_uneven_skin_and_no_sun_in_its_place(above):
    """On a ball, whose transfer is known: shading by the fit against the true one, after a gain. What 600 points of
    skin that varies by 0.1 tell of nine numbers is right to 0.012; with a sky held nearly even it was 0.025 and
    0.055."""
    normals = fibonacci_sphere(600)
    transfer = sh_basis(normals) * per_function(LAMBERT)
    sky = np.zeros((9, 3))
    sky[0], sky[2] = sunlight.UNIFORM, above * sunlight.UNIFORM
    true = transfer @ sky
    uneven = np.exp(0.1 * np.random.default_rng(0).normal(size=(600, 1)))
    light, reached, _ = sunlight.fit_light(
        0.4 * true * uneven, normals, transfer, lambda direction: (normals @ direction > 0).astype(float), np.ones(600)
    )
    fitted = light.ambient(transfer) + reached[:, None] * light.direct(normals)
    off = np.log(fitted / true)
    assert (off - off.mean(0)).std() < 0.02
    assert not light.has_sun
