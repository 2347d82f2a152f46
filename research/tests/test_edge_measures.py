# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left along a shadow's edge, on drawn edges of known step and line."""

import cv2
import numpy as np
import pytest

from core.light.shadow_edges import signed_distance
from research.benchmarks.measures.edges import ALONG, LINE, score_edges

HEIGHT = 500
SHADOW = np.zeros((600, 500), bool)
SHADOW[:, 260:] = True
MASK = np.zeros(SHADOW.shape, bool)
MASK[20:580, 20:480] = True
TRUE = 0.06 * np.random.default_rng(3).standard_normal(SHADOW.shape)  # pores
AT = np.abs(signed_distance(SHADOW)) < LINE * HEIGHT


def score(residual, detail=TRUE, shadow=SHADOW):
    return score_edges((detail + residual).astype(np.float64), TRUE, shadow, MASK, HEIGHT)


def test_an_answer_without_light_has_nothing_along_the_edge():
    found = score(np.zeros(SHADOW.shape))
    assert found.step == pytest.approx(0, abs=1e-4) and found.overshoot == pytest.approx(0, abs=1e-4)
    assert found.detail_within == pytest.approx(1) and found.detail_away == pytest.approx(1)


@pytest.mark.parametrize("step", [0.3, -0.2])
def test_a_step_is_no_line(step):
    found = score(np.where(SHADOW, 0, step))
    assert found.step == pytest.approx(step, abs=1e-3) and found.overshoot == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize(("height", "bright", "dark"), [(0.15, 0.15, 0), (-0.1, 0, 0.1)])
def test_a_line_is_what_it_rises_above_the_higher_side_or_falls_below_the_lower(height, bright, dark):
    found = score(np.where(AT, height, 0))
    assert (
        found.bright == pytest.approx(bright, abs=0.002)
        and found.dark == pytest.approx(dark, abs=0.002)
        and found.step == pytest.approx(0, abs=1e-3)
    )
    over_a_step = score(np.where(AT, 0.25, np.where(SHADOW, 0, 0.2)))
    assert over_a_step.bright == pytest.approx(0.05, abs=0.005) and over_a_step.step == pytest.approx(0.2, abs=0.005)


def test_lost_pores_are_no_line_and_are_told_by_the_detail():
    blurred = cv2.GaussianBlur(TRUE, (0, 0), 6)
    near = np.abs(signed_distance(SHADOW)) < 0.02 * HEIGHT
    found = score(np.zeros(SHADOW.shape), np.where(near, blurred, TRUE))
    assert found.overshoot < 0.01 and found.detail_within < 0.6 and found.detail_away > 0.95
    assert score(-TRUE).detail_away == 0.0


def test_without_an_edge_there_is_no_figure():
    nothing = score(np.zeros(SHADOW.shape), shadow=np.zeros_like(SHADOW))
    assert nothing.step is None and nothing.overshoot is None
    assert score_edges(TRUE, TRUE, SHADOW, MASK, HEIGHT, lit=np.zeros_like(SHADOW)).step is None
    assert ALONG > LINE
