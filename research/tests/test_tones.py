# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cues to the skin tone: a known distribution is fitted, and a picture's look is that of the person, not of the
camera."""

import numpy as np
import pytest

from core.stages.solve.look import Look, to_coordinates
from core.stages.solve.population import FREEDOM, SHEEN_REFLECTANCE, to_lab
from research.training import tones
from research.training.sights import SightStore

COVARIANCE = np.array([[0.004, 0.0006], [0.0006, 0.008]])
PEOPLE = {
    "lightness": tones.LIGHTNESS,
    "ratios": np.tile([0.6, -0.5], (len(tones.LIGHTNESS), 1)),
    "ratio_covariance": COVARIANCE,
}


def test_a_cue_is_fitted_to_what_is_drawn_of_it(monkeypatch):
    monkeypatch.setattr(tones, "GROWTHS", np.arange(0, 2.1, 0.4))
    rng = np.random.default_rng(0)
    slope, offset = np.array([[0.8, -0.1, 0], [0, 1.1, 0], [0, 0.1, 0.7]]), np.array([0.5, -0.1, 0.2])
    root, growth = np.diag([0.1, 0.05, 0.08]), np.array([1.6, 0.4, 0.4])
    sittings, shown = [], []
    for _ in range(2000):
        tone = np.exp(rng.normal([-1.2, -1.8, -2.2], 0.4))
        unevenness = rng.uniform(0.2, 2)
        stray = root @ rng.normal(size=3) / np.sqrt(rng.chisquare(FREEDOM) / FREEDOM)
        shown.append(
            slope @ to_coordinates(tone + SHEEN_REFLECTANCE) + offset + stray * np.exp(0.5 * growth * unevenness)
        )
        sittings.append(tones.Sitting(Look(shown[-1], unevenness), tone, np.ones(3)))
    cue = tones._fit_cue(
        sittings, [(each, sitting.look.unevenness) for each, sitting in zip(shown, sittings, strict=True)]
    )
    assert cue["growth"] == pytest.approx(growth, abs=0.01)
    assert np.allclose(cue["slope"], slope, atol=0.05) and np.allclose(cue["offset"], offset, atol=0.08)
    assert np.allclose(np.sqrt(np.diag(cue["scale"])), [0.1, 0.05, 0.08], rtol=0.12)


def test_what_skin_is_over_the_whites_of_the_eyes_has_no_camera_in_it(tmp_path, monkeypatch):
    monkeypatch.setattr(tones, "TEXELS", 256)
    monkeypatch.setattr(tones, "LIGHTS", 1)
    store = SightStore(tmp_path, "tone", 1)
    tones.make_sights(store, 1000)
    looks = []
    for gain in (np.array([0.15, 0.15, 0.15]), np.array([0.3, 0.22, 0.16])):

        def expose(radiance: np.ndarray, face: np.ndarray, rng: np.random.Generator, gain=gain) -> tuple:
            gain = gain / radiance[face].mean()
            return np.clip(radiance * gain, 0, 1).astype(np.float32), gain

        monkeypatch.setattr(tones, "_meter", lambda albedo, expose=expose: expose)
        looks += [sitting.look for sitting in tones.sit(store, range(1000, 1001), [], PEOPLE)]
    cast = to_coordinates(np.array([0.3, 0.22, 0.16])) - to_coordinates(np.full(3, 0.15))
    assert np.allclose(looks[1].skin - looks[0].skin, cast, atol=0.15), "the camera's curve bends it a little"
    assert np.allclose(looks[1].eyes.over_white, looks[0].eyes.over_white, atol=0.12)


def test_subjects_get_tones_of_measured_people():
    drawn = np.array([tones._draw_tone(PEOPLE, np.random.default_rng(seed)) for seed in range(400)])
    lightness, ratios = to_lab(drawn)[:, 0], to_coordinates(drawn)[:, 1:]
    assert 20 <= lightness.min() < 25 and 65 < lightness.max() <= 70
    assert np.allclose(ratios.mean(0), [0.6, -0.5], atol=0.02) and np.allclose(np.cov(ratios.T), COVARIANCE, atol=1e-3)


def test_a_neck_is_fitted_over_its_face_with_origins_weighed_alike():
    """Half as bright at L* 50 and a hundredth less by each L*; one origin has more people, without another answer."""
    rng, people = np.random.default_rng(0), []
    for origin, count in (("a", 200), ("b", 20)):
        for _ in range(count):
            lightness = rng.uniform(30, 65)
            face = np.array([1.3, 1.0, 0.7]) * ((lightness + 16) / 116) ** 3
            off = to_lab(face)[0] - 50
            neck = face * np.exp(np.log(0.5) - 0.01 * off + rng.normal(0, 0.02, 3))
            people.append((origin, face, None if rng.random() < 0.1 else neck))
    fitted = tones.fit_necks(people)
    assert np.allclose(fitted["log_gain"], np.log(0.5), atol=0.02)
    assert np.allclose(fitted["log_gain_by_lightness"], -0.01, atol=2e-3)
