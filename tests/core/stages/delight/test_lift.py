# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaving pores out of a large picture: what it costs per pixel, and that it gives what one wide filter would."""

import cv2
import numpy as np
import pytest

from core.stages.delight import lift


def _skin(side: int) -> tuple[np.ndarray, np.ndarray]:
    """The log of a picture [S, S, 1] and of its shading [S, S]: a round cheek, a shadow with a curved edge, and pores
    of one pixel up to a five-hundredth of the side."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) / side
    shading = -0.8 * np.clip(2 * x - 1, 0, 1) ** 2 - 1.2 * (y > 0.4 + 0.2 * np.sin(5 * x))
    shading = cv2.GaussianBlur(shading.astype(np.float32), (0, 0), 0.001 * side)  # no lens draws a sharper edge
    pores = 0
    for spread, sigma in ((0.03, 0.6), (0.05, 0.001 * side), (0.04, 0.002 * side)):
        noise = cv2.GaussianBlur(rng.standard_normal((side, side)).astype(np.float32), (0, 0), sigma)
        pores = pores + spread * noise / noise.std()
    return (shading - 1 + pores)[..., None].astype(np.float32), shading


def _exact(log: np.ndarray) -> np.ndarray:
    return cv2.bilateralFilter(log[..., 0], -1, lift.PORE_LOG, lift.PORE_SHARE * len(log))[..., None]


def test_a_pixel_of_a_large_picture_costs_no_more_than_one_of_a_usual_picture(monkeypatch):
    looked_at = []

    def count(picture, _, __, sigma):
        looked_at.append(picture.size * (2 * round(1.5 * sigma) + 1) ** 2)  # OpenCV's radius
        return picture

    monkeypatch.setattr(cv2, "bilateralFilter", count)
    of_a_pixel = {}
    for side in (1000, 1001, 2500, 4001):
        looked_at.clear()
        lift.remove_pores(np.zeros((side, side, 1), np.float32))
        of_a_pixel[side] = sum(looked_at) / side**2
    assert of_a_pixel.pop(1000) == 19**2
    assert max(of_a_pixel.values()) <= 19**2, of_a_pixel


def test_up_to_a_thousand_pixels_one_filter_of_the_whole_width_is_what_is_done():
    log, _ = _skin(1000)
    assert np.array_equal(lift.remove_pores(log), _exact(log))


@pytest.mark.parametrize("side", [1100, 1701])
def test_a_large_picture_loses_the_pores_that_one_wide_filter_would_take(side):
    log, shading = _skin(side)
    exact, found = _exact(log), lift.remove_pores(log)
    apart = np.abs(found - exact)
    assert apart.mean() < 0.004 and np.quantile(apart, 0.99) < 0.015
    left, over = (float((guide[..., 0] + 1 - shading).std()) for guide in (exact, found))
    assert over < 1.1 * left < 0.5 * float((log[..., 0] + 1 - shading).std())


def test_the_shading_of_a_large_picture_is_that_by_one_wide_filter(monkeypatch):
    log, shading = _skin(1400)
    coarse = cv2.resize(shading, (128, 128), interpolation=cv2.INTER_AREA)[..., None]
    found = lift.lift_shading(coarse, log)
    monkeypatch.setattr(lift, "remove_pores", _exact)
    exact = lift.lift_shading(coarse, log)
    assert np.abs(found - exact).mean() < 0.001 and np.quantile(np.abs(found - exact), 0.99) < 0.01
    errors = [float(np.abs(lifted[..., 0] - shading).mean()) for lifted in (found, exact)]
    assert errors[0] < 1.05 * errors[1] < 0.005
