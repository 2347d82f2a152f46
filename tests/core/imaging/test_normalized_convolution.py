# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A weighted blur averages what counts and nothing else."""

import cv2
import numpy as np
import pytest

from core.imaging.normalized_convolution import weighted_blur

COLOUR = np.float32([0.2, 0.5, 0.8])


@pytest.mark.parametrize("shrink", [1, 4])
@pytest.mark.parametrize("border", [cv2.BORDER_DEFAULT, cv2.BORDER_REPLICATE])
def test_one_colour_stays_whatever_lies_where_nothing_counts(shrink, border):
    weight = np.random.default_rng(0).random((40, 56)) > 0.5
    image = np.where(weight[..., None], COLOUR, 9.0)
    blurred = weighted_blur(image, weight, 6.0, shrink=shrink, border=border)
    assert blurred.shape == image.shape and blurred == pytest.approx(np.broadcast_to(COLOUR, image.shape), abs=1e-5)


def test_with_an_even_weight_it_is_the_gaussian_blur():
    image = np.random.default_rng(0).random((32, 24), np.float32)
    blurred = weighted_blur(image, np.full((32, 24), 0.3, np.float32), 2.0)
    assert blurred == pytest.approx(cv2.GaussianBlur(image, (0, 0), 2.0), abs=1e-6)


def test_two_pixels_are_averaged_by_their_weights_and_far_from_them_nothing_is_left():
    image, weight = np.zeros((1, 200), np.float32), np.zeros((1, 200), np.float32)
    image[0, [49, 51]], weight[0, [49, 51]] = [1.0, 4.0], [3.0, 1.0]
    blurred = weighted_blur(image, weight, 5.0)
    assert blurred[0, 50] == pytest.approx((3 * 1 + 1 * 4) / 4) and blurred[0, 150] == 0
