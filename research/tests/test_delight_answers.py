# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the delighter's answers are best believed, on answers whose errors are known."""

import numpy as np
import pytest

from core.stages.delight.second_opinion import Weighing
from research.benchmarks.delighting import delight_answers
from research.benchmarks.delighting.delight_answers import Judged


def judged(person, frames_error, fitted_error, cells=4000):
    """A capture whose answers err by independent noise, grey and of mean 0."""
    rng = np.random.default_rng(sum(map(ord, person)))

    def noise(deviation):
        grey = rng.standard_normal((cells, 1)) * deviation
        return np.repeat(grey - grey.mean(), 3, 1).astype(np.float32)

    true = noise(0.5)
    frames = true + noise(frames_error)
    return Judged(person, true, true + noise(2 * frames_error), frames, true + noise(fitted_error), frames)


@pytest.fixture(scope="module")
def people():
    return {name: judged(name, 0.1, 0.1) for name in ("anna", "ben", "cleo")}


def test_of_two_equal_and_independent_answers_the_mean_is_best(people):
    rows, chosen = delight_answers.score(people)
    assert rows["anna"]["frames"] == pytest.approx(0.1, rel=0.05) == rows["anna"]["fitted"]
    assert rows["anna"]["alone"] == pytest.approx(0.2, rel=0.05) and rows["anna"]["together"] == rows["anna"]["frames"]
    fitted = chosen["fitted"]
    weight = fitted["share"] / (1 + 2 * 0.1**2 / fitted["doubt"] ** 2)
    assert weight == pytest.approx(0.5, abs=0.07)
    assert fitted["best"] == pytest.approx(0.1 / np.sqrt(2), rel=0.03) and fitted["people_better"] == 3
    assert fitted["without"] == pytest.approx(0.1, rel=0.03)
    assert fitted["left_out"] == pytest.approx(fitted["best"], rel=0.03)


def test_people_count_alike_however_often_they_were_filmed():
    rows = {
        name: {"person": person, **dict.fromkeys(delight_answers.ROWS, error)}
        for name, person, error in (("a", "anna", 0.1), ("b", "ben", 0.3), ("c", "ben", 0.5))
    }
    means = delight_answers.over_people(rows)
    assert means["frames"] == pytest.approx(0.2) and "| **over people** | 0.200 |" in delight_answers.table(rows)


def test_a_person_on_whom_an_answer_fails_is_told_by_how_far_the_two_lie_apart(people):
    """One weight for all would cost him what the others gain; the doubt keeps both."""
    odd = {**people, "dora": judged("dora", 0.1, 0.8)}
    _, chosen = delight_answers.score(odd)
    fitted = chosen["fitted"]
    near = fitted["share"] / (1 + 2 * 0.1**2 / fitted["doubt"] ** 2)
    far = fitted["share"] / (1 + (0.1**2 + 0.8**2) / fitted["doubt"] ** 2)
    assert near > 0.3 and far < 0.05


def test_what_is_scored_is_what_the_delighter_does():
    each = judged("anna", 0.1, 0.1)
    weighed = delight_answers.weighed(each.frames, each.fitted, Weighing(0.6, 0.15))
    apart = each.fitted - each.frames
    weight = 0.6 / (1 + np.mean((apart - np.median(apart, 0)).mean(-1) ** 2) / 0.15**2)
    assert weighed == pytest.approx(each.frames + weight * (apart - np.median(apart, 0)), abs=1e-5)
