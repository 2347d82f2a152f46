# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ten swatches: even in lightness, of measured skin, in one person's hue; against the colour science of a library."""

import json

import numpy as np
import pytest
from skimage import color

from core.settings import skin_swatches
from core.settings.skin_swatches import (
    find_lightness,
    find_warmth,
    is_unsure,
    make_swatches,
    make_warmer,
    nearest_swatch,
    swatches_within,
)

MEASURED = json.loads(skin_swatches.MODEL_FILE.read_text(encoding="utf-8"))
OLIVE = (0.60, 0.47, 0.33)


def hues(colours) -> np.ndarray:
    """ln R/G and ln B/G of sRGB colours [N, 3]."""
    srgb = np.array(colours)
    log = np.log(np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4))
    return log[:, [0, 2]] - log[:, 1:2]


def test_ten_swatches_go_evenly_from_the_lightest_skin_that_was_measured_to_the_darkest():
    lightness = color.rgb2lab(np.array(make_swatches()))[:, 0]
    ends = MEASURED["lightness"][-1], MEASURED["lightness"][0]
    assert np.allclose(lightness, np.linspace(*ends, 10), atol=0.1)
    assert [find_lightness(swatch) for swatch in make_swatches()] == pytest.approx(lightness, abs=0.02)
    mean = [np.interp(lightness, MEASURED["lightness"], column) for column in zip(*MEASURED["ratios"], strict=True)]
    assert np.allclose(hues(make_swatches()).T, mean, atol=0.01)


def test_a_persons_hue_is_carried_to_all_ten_and_the_person_is_on_the_scale():
    of_person = hues(make_swatches(OLIVE)) - hues(make_swatches())
    assert np.allclose(of_person, of_person[0], atol=0.01), "one departure at every lightness"
    numbers = np.arange(1, 11)
    levels = [find_lightness(swatch) for swatch in make_swatches(OLIVE)]
    here = np.interp(-find_lightness(OLIVE), -np.array(levels), numbers)
    at = [np.interp(here, numbers, channel) for channel in np.array(make_swatches(OLIVE)).T]
    assert np.allclose(at, OLIVE, atol=0.01) and nearest_swatch(OLIVE) == round(here)


def test_a_warmer_tone_has_more_red_less_blue_and_the_same_lightness():
    warm = make_warmer(OLIVE, 1.5)
    assert warm[0] > OLIVE[0] and warm[2] < OLIVE[2]
    assert find_lightness(warm) == pytest.approx(find_lightness(OLIVE), abs=0.05)
    assert find_warmth(warm, OLIVE) == pytest.approx(1.5, abs=0.01) and find_warmth(OLIVE, OLIVE) == 0
    assert make_warmer(warm, -1.5) == pytest.approx(OLIVE, abs=2e-4)
    assert make_swatches(OLIVE, 1.5)[4] == pytest.approx(make_warmer(make_swatches(OLIVE)[4], 1.5), abs=2e-4)


def test_one_step_of_warmth_is_one_deviation_of_measured_people():
    """Of people drawn by the measured covariance the warmth has a deviation of one, whatever their lightness."""
    rng = np.random.default_rng(0)
    drawn = rng.multivariate_normal([0, 0], MEASURED["ratio_covariance"], 4000)
    warmth = [find_warmth(skin_swatches._colour_of(50, tuple(hue + MEASURED["ratios"][30]))) for hue in drawn]
    assert np.std(warmth) == pytest.approx(1, abs=0.03) and np.mean(warmth) == pytest.approx(0, abs=0.05)


def test_an_estimate_shades_what_lies_within_its_deviation_and_asks_where_that_spans_more_than_three():
    sixth = make_swatches()[5]
    assert swatches_within(sixth, 0.5) == [6] and swatches_within(sixth, 6) == [5, 6, 7]
    between = make_warmer(sixth, 0)
    assert swatches_within(between, 12) == [4, 5, 6, 7, 8]
    step = find_lightness(make_swatches()[0]) - find_lightness(make_swatches()[1])
    assert not is_unsure(1.45 * step) and is_unsure(1.55 * step)
