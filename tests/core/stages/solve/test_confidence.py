# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The confidence of the solved maps: how large an error is expected of a texel, less where it was seen less; and
whether the benchmark finds deviations that were laid in."""

import numpy as np
import pytest
import torch

from core.face.head import read_filmed_head
from core.imaging import images
from core.stages.solve import confidence
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.confidence import PLAIN_DEVIATION, estimate_confidence
from research.benchmarks.maps import confidence as benchmark
from research.benchmarks.maps.confidence import Errors, fit_deviations, judge
from tests.fixtures.painted_skin import make, plain_evidence

SIZE = 256
PLANE = torch.ones(SIZE, SIZE)
SKIN = np.full((SIZE, SIZE, 3), [0.42, 0.26, 0.18], np.float32)


def told(albedo: np.ndarray = SKIN, **changed: torch.Tensor) -> float:
    """In the middle of the map."""
    return float(estimate_confidence(plain_evidence(SIZE, **changed), albedo)[SIZE // 2, SIZE // 2])


def test_plain_skin_has_all_of_it_and_what_was_seen_less_has_less():
    assert told() == pytest.approx(1) and told(weight=0.4 * PLANE) == pytest.approx(0.4)
    assert told(weight=0 * PLANE) == 0
    assert told(0.2 * SKIN) == pytest.approx(1), "dark skin is as sure as light skin"


def test_variances_add_up():
    """Each texel's confidence is the deviation of plain skin over its own."""
    unlike = np.hypot(PLAIN_DEVIATION, confidence.UNLIKE_SKIN)
    assert told(trust=0 * PLANE) == pytest.approx(PLAIN_DEVIATION / unlike)
    quarter = np.hypot(confidence.WHOLE_FACE, 2 * confidence.WEAKLY_LIT)
    assert told(filmed=PLANE / 4) == pytest.approx(PLAIN_DEVIATION / quarter)
    assert told(filmed=4 * PLANE) == 1, "the light was never better than known"
    # a checkerboard of single texels has no mean to vary about but its own: its deviation is its amplitude
    rough = SKIN * np.exp(0.1 * (-1.0) ** np.indices((SIZE, SIZE)).sum(0))[..., None].astype(np.float32)
    assert told(rough) == pytest.approx(PLAIN_DEVIATION / np.hypot(PLAIN_DEVIATION, 0.1 * confidence.VARIED), rel=0.01)


def test_how_bright_the_frames_were_is_over_the_skin_that_they_showed(tmp_path):
    capture = make(tmp_path / "a.wildcap")
    alone = read_evidence(capture, read_filmed_head(capture), SIZE)
    skin = (alone.skin * alone.weight > 0.5).numpy()
    assert np.median(alone.filmed.numpy()[skin]) == pytest.approx(1, rel=1e-3), "of the texture, where no other is"
    lit = np.full((SIZE, SIZE, 3), 0.4, np.float32)
    lit[:, : SIZE // 2] = 0.1
    lit[:, SIZE // 2] = 0.2
    images.write_srgb(capture.texture_filmed, images.linear_to_srgb(lit))
    filmed = read_evidence(capture, read_filmed_head(capture), SIZE).filmed.numpy()
    assert filmed[8, SIZE - 8] / filmed[8, 8] == pytest.approx(4, rel=0.02)


def laid_in(seed: int, size: float, count: int = 60000) -> Errors:
    """Errors with known deviations, all of them `size` times as large."""
    rng = np.random.default_rng(seed)
    parts = np.stack(
        [np.ones(count), rng.exponential(0.002, count), rng.random(count) < 0.3, rng.uniform(0.5, 8, count)], 1
    )
    sigma = size * np.sqrt(parts @ np.square(LAID_IN))
    return Errors(f"person {seed}", rng.normal(0, sigma), parts, sigma)


LAID_IN = np.array([0.08, 2.0, 0.15, 0.05])


def test_deviations_that_were_laid_in_are_found(monkeypatch):
    monkeypatch.setattr(benchmark, "FEW", 30000)
    found = fit_deviations(laid_in(seed, size) for seed, size in ((0, 0.5), (1, 1.0), (2, 3.0)))
    assert found == pytest.approx(LAID_IN, rel=0.15), "of the capture in the middle, whatever the others' size"


def test_what_knows_the_errors_gains_likelihood_and_a_constant_does_not():
    given = laid_in(3, 1.0)
    known, constant = judge(given.error, given.blurred), judge(given.error, np.linspace(0.999, 1.001, len(given.error)))
    root = np.sqrt(np.mean(given.blurred**2))
    assert known["gained"] == pytest.approx(float(np.log(root) - np.mean(np.log(given.blurred))), abs=0.01)
    assert known["coverage"] == pytest.approx(0.683, abs=0.01) == known["coverage_absolute"]
    assert known["spearman"] > 0.15 and known["half"] < 0.8
    assert constant["gained"] == pytest.approx(0, abs=1e-3)
