# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far traits reach, and where skins differ, is measured as it was laid in; what is measured can be kept as a
record."""

import numpy as np
import pytest

from core.stages.solve.head_cells import place_cells
from research.benchmarks.maps import traits
from research.training.traits import LargeShapes, deviations_at


def test_the_correlation_of_a_known_field_falls_as_it_was_made():
    """A field on a line whose correlation is exp(-distance / 20 mm)."""
    rng, places = np.random.default_rng(0), np.linspace(0, 80, 161)
    lower = np.linalg.cholesky(np.exp(-np.abs(places[:, None] - places) / 20) + 1e-9 * np.eye(161))
    fields = (lower @ rng.standard_normal((161, 4000))).T
    i, j = rng.integers(0, 161, (2, 20000))
    found = traits.correlation_by_distance((fields[:, i] * fields[:, j]).mean(0), np.abs(places[i] - places[j]))
    for name, value in found.items():
        low, high = (float(word) for word in name.removesuffix(" mm").split(" to "))
        assert np.exp(-high / 20) - 0.05 < value < np.exp(-low / 20) + 0.05, name


def laid_in(seed: int, count: int = 40) -> LargeShapes:
    """Skins on the built-in head that differ independently from place to place, three times as much above the brows
    as below them."""
    places = place_cells(48)[0]
    places = places[(np.abs(places[:, 0]) < 0.06) & (places[:, 1] < 0) & (places[:, 2] > -0.09)]
    forehead = traits.regions(places)["forehead"]
    ratio = np.random.default_rng(seed).normal(0, np.where(forehead, 0.3, 0.1), (count, len(places)))
    return LargeShapes(places, ratio)


def test_where_skins_differ_more_is_found_and_both_sides_are_alike():
    found = laid_in(0)
    varied = deviations_at(found.places, found)
    high = found.places[:, 2]
    brows = found.places[traits.regions(found.places)["forehead"]][:, 2].min()
    assert np.median(varied[high > brows + 0.01]) / np.median(varied[high < brows - 0.02]) == pytest.approx(3, rel=0.2)
    assert deviations_at(found.places * [-1, 1, 1], found) == pytest.approx(varied)
    assert deviations_at(np.array([[0.0, 1.0, 0.0]]), found) == pytest.approx(1), "where nobody looked"


def test_scores_of_skins_that_follow_the_model_have_a_deviation_of_one_in_each_region():
    z = traits.measure(laid_in(1))["z"]
    assert z["all"] == pytest.approx(1, abs=0.1) and z["most"] < 1.5
    assert all(0.7 < value < 1.4 for value in z["regions"].values()), z
    text = "\n".join(
        body
        for _, body in traits.sections(
            {traits.PAINTED: traits.measure(laid_in(1)), traits.UNLIT: traits.measure(laid_in(2))}
        )
    )
    assert "| light taken out |" in text and "around the eyes" in text
