# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from core.face import template
from research.people.lifelike import expression
from research.people.lifelike.figure import make_figure

OPEN = 3  # seed of a person with open eyes


@pytest.mark.parametrize("name", ["mouthSmile", "browInnerUp"])
def test_both_halves_of_a_unit_mirror_each_other(name):
    vertices = template.load().vertices
    moves = sum(expression._unit(name))
    moved = np.linalg.norm(moves, axis=1) > 1e-3
    left = moved & (vertices[:, 0] > 0.005)
    assert 50 < left.sum() < 0.5 * len(vertices)
    for vertex in np.flatnonzero(left)[::40]:
        other = np.linalg.norm(vertices - vertices[vertex] * [-1, 1, 1], axis=1).argmin()
        assert np.allclose(moves[other] * [-1, 1, 1], moves[vertex], atol=2e-4)


def test_a_squint_narrows_the_lids_and_leaves_the_eyeballs_where_they_were():
    moves = sum(sum(expression._unit(name)) for name in expression.MOODS["squint"])
    at_rest = make_figure(OPEN, 64)
    squinting = make_figure(OPEN, 64, expression=expression.Expression(moves, 0.4))
    for rest, now in zip(at_rest.opened.balls, squinting.opened.balls, strict=True):
        assert np.array_equal(rest.centre, now.centre)

    def gap(opened) -> float:
        upper, lower = opened.rims[0]
        return float(opened.skin.vertices[upper, 2].max() - opened.skin.vertices[lower, 2].min())

    assert gap(squinting.opened) < 0.7 * gap(at_rest.opened)
