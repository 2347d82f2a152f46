# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coarse answer lifted along the picture's edges, and pores left out of a large picture."""

import cv2
import numpy as np

from core.stages.delight import lift


def test_a_lifted_shadow_edge_lies_where_the_picture_has_it():
    """Skin with pores, and a shadow whose edge falls inside a coarse cell: the coarse answer blurs it, the lifted one
    does not, and no pore passes into it."""
    rng = np.random.default_rng(0)
    pores = 0.05 * cv2.GaussianBlur(rng.standard_normal((256, 256)).astype(np.float32), (0, 0), 0.8) / 0.35
    shading = np.zeros((256, 256), np.float32)
    shading[:, 101:] = -1.2
    coarse = cv2.resize(shading, (64, 64), interpolation=cv2.INTER_AREA)
    log = np.repeat((shading + pores - 1)[..., None], 3, -1)
    lifted = lift.lift_shading(np.repeat(coarse[..., None], 3, -1), log)[..., 0]
    plain = cv2.resize(coarse, (256, 256), interpolation=cv2.INTER_LINEAR)
    edge = slice(97, 105)
    assert np.abs(lifted - shading)[:, edge].mean() < 0.35 * np.abs(plain - shading)[:, edge].mean()
    assert np.abs(lifted - shading)[:, :80].mean() < 0.02
    rest = (log[..., 0] - lifted)[:, 10:90]
    assert np.corrcoef(rest.ravel(), pores[:, 10:90].ravel())[0, 1] > 0.98


def test_a_lifted_share_stays_a_share():
    share = np.zeros((32, 32), np.float32)
    share[:, 16:] = 1
    log = np.repeat(-2 * cv2.resize(share, (128, 128), interpolation=cv2.INTER_NEAREST)[..., None], 3, -1)
    lifted = lift.lift_share(share, log)
    assert lifted.min() >= 0 and lifted.max() <= 1
    assert lifted[:, :52].max() < 0.05 and lifted[:, 76:].min() > 0.95
    assert lifted[:, 63].mean() < 0.35 and lifted[:, 64].mean() > 0.65


def skin(side: int) -> tuple[np.ndarray, np.ndarray]:
    """The log of a picture [S, S, 1] and of its shading [S, S]: a round cheek, a shadow with a curved edge, and pores
    of one pixel up to a five-hundredth of a picture thrice as large."""
    rng, reference = np.random.default_rng(0), 3 * side
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) / side
    shading = -0.8 * np.clip(2 * x - 1, 0, 1) ** 2 - 1.2 * (y > 0.4 + 0.2 * np.sin(5 * x))
    shading = cv2.GaussianBlur(shading.astype(np.float32), (0, 0), 0.001 * reference)  # no lens draws a sharper edge
    pores = 0
    for spread, sigma in ((0.03, 0.6), (0.05, 0.001 * reference), (0.04, 0.002 * reference)):
        noise = cv2.GaussianBlur(rng.standard_normal((side, side)).astype(np.float32), (0, 0), sigma)
        pores = pores + spread * noise / noise.std()
    return (shading - 1 + pores)[..., None].astype(np.float32), shading


def test_a_pixel_of_a_large_picture_costs_no_more_than_one_of_a_usual_picture(monkeypatch):
    areas = []

    def count(picture, _, __, sigma):
        areas.append(picture.size * (2 * round(1.5 * sigma) + 1) ** 2)  # OpenCV's radius
        return picture

    monkeypatch.setattr(cv2, "bilateralFilter", count)
    for side in (1000, 1001, 2500):
        areas.clear()
        lift.remove_pores(np.zeros((side, side, 1), np.float32))
        cost = sum(areas) / side**2
        assert cost == 19**2 if side == 1000 else cost <= 19**2, side


def test_a_large_picture_loses_the_pores_that_one_wide_filter_would_take(monkeypatch):
    monkeypatch.setattr(lift, "PORE_SHARE", 3 * lift.PORE_SHARE)  # as of a picture thrice as large
    log, shading = skin(567)
    reference = cv2.bilateralFilter(log[..., 0], -1, lift.PORE_LOG, lift.PORE_SHARE * len(log))[..., None]
    smooth = lift.remove_pores(log)
    apart = np.abs(smooth - reference)
    assert 0 < apart.mean() < 0.004 and np.quantile(apart, 0.99) < 0.015
    errors = [float((guide[..., 0] + 1 - shading).std()) for guide in (reference, smooth, log)]
    assert errors[1] < 1.1 * errors[0] < 0.5 * errors[2]
