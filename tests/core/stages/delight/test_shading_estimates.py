# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is put right in the shadings of a capture's views: one albedo for one head, the hue of skin, hair, the outlines of
shadows, and the coarse answer lifted along the picture's edges."""

import cv2
import numpy as np
import pytest

from core.face import template
from core.face.head import Head
from core.geometry.raster import render_view
from core.imaging import images
from core.stages.delight import lift
from core.stages.delight.below_hair import FITTED_SHARE, complete_shading, fill_features, fill_hair
from core.stages.delight.casts import remove_casts, settle_dim_hues
from core.stages.delight.evening import ShadingEstimate, estimate_exposures, even_out, robust_mean
from core.stages.delight.lit_head import LitHead
from core.stages.delight.network import divide
from core.stages.delight.occlusion import remove_seams
from research.people.sight import random_camera


def test_the_hue_of_the_shade_leaves_the_albedo_and_that_of_lips_stays():
    """One skin under a sun and a bluer shade, whose difference the shading missed by a third; lips are redder by
    themselves."""
    rng = np.random.default_rng(0)
    shadow = np.zeros((64, 64), np.float32)
    shadow[:, 30:] = 1
    noise = 0.02 * rng.standard_normal((64, 64, 3)).astype(np.float32)
    light = shadow[..., None] * np.float32([-1.5, -1.3, -1.1]) + noise
    albedo = np.log(np.float32([0.5, 0.35, 0.27])) + np.zeros((64, 64, 3), np.float32)
    albedo[40:44, 10:50] += np.float32([0.1, -0.4, -0.3])
    said = light - shadow[..., None] * np.float32([-0.07, 0, 0.07])
    given = ShadingEstimate((0, 0, 64), said, shadow, light + albedo)
    (mended,) = remove_casts([given], [np.ones((64, 64), np.float32)])

    def hue(look):
        left = look.log - look.shading
        return left - left.mean(-1, keepdims=True)

    before, after = (hue(look)[:, 30:].mean((0, 1)) - hue(look)[:, :30].mean((0, 1)) for look in (given, mended))
    assert np.abs(before).max() > 0.06 and np.abs(after).max() < 0.01
    lips = hue(mended)[41:43, 12:48].mean((0, 1)) - hue(mended)[:38].mean((0, 1))
    assert lips == pytest.approx([0.3, -0.2, -0.1], abs=0.02)
    assert np.abs((mended.shading - said).mean(-1)).max() < 1e-3  # luminance is left alone


def test_skin_too_dark_to_tell_its_hue_takes_that_of_the_rest_and_bright_skin_keeps_its_own():
    """Skin in columns of ever less light, a code value off in each channel: nothing much to bright skin."""
    rng = np.random.default_rng(0)
    own = rng.normal(0, [[0.04, 0.01, 0.05]], (64 * 64, 3)).reshape(64, 64, 3)
    own -= own.mean(-1, keepdims=True)
    light = np.linspace(0, -5, 64)[None, :, None] + np.zeros((64, 64, 3))
    albedo = np.log([0.5, 0.3, 0.2]) + own
    written = images.linear_to_srgb(np.exp(light + albedo)) + rng.normal(0, 1 / 255, own.shape)
    log = np.log(np.maximum(images.srgb_to_linear(written), 1e-3))
    given = ShadingEstimate((0, 0, 64), light.astype(np.float32), np.zeros((64, 64), np.float32), log)
    skin = np.ones((64, 64), np.float32)
    skin[:8] = 0
    (settled,) = settle_dim_hues([given], [skin])

    def error(look, columns):
        off = (look.log - look.shading - albedo)[8:, columns]
        return float(np.sqrt(((off - off.mean(-1, keepdims=True)) ** 2).mean()))

    bright, dim = np.s_[:12], np.s_[52:]
    assert error(given, dim) > 0.09 and error(settled, dim) < 0.03
    assert error(settled, bright) < error(given, bright) < 0.015
    assert np.array_equal(settled.shading[:8], given.shading[:8]), "what is no skin stays"
    assert np.abs((settled.shading - given.shading).mean(-1)).max() < 1e-5  # and luminance


def test_exposures_are_found_and_highlights_drop_out():
    """Log colours of some points in views of different exposure, a tenth of them burnt by a highlight; some points seen
    by one view alone."""
    rng = np.random.default_rng(0)
    true, level = rng.normal(-1, 0.3, (400, 3)), rng.normal(0, 0.3, (5, 3))
    level -= level.mean(0)
    colours = true + level[:, None] + rng.normal(0, 0.01, (5, 400, 3))
    colours[rng.random((5, 400)) < 0.1] += 1.5
    weights = np.ones((5, 400), np.float32)
    weights[1:, :50] = 0
    exposures = estimate_exposures(colours, weights)
    assert np.abs(exposures - level).max() < 0.02
    mean = robust_mean(colours - exposures[:, None], weights)
    assert np.median(np.abs(mean - true)[:50]) < 0.03, "keeps the others' exposure"
    assert np.quantile(np.abs(mean - true)[50:], 0.9) < 0.05
    assert np.abs((colours - exposures[:, None]).mean(0) - true).max() > 0.2


def test_views_are_brought_to_one_albedo():
    """Three looks at one head whose shadings are off by a constant and by a slope: afterwards what they leave as albedo
    agrees."""
    mesh = template.load()
    nowhere = np.zeros(len(mesh.vertices))
    head = Head(mesh)
    lit = LitHead(head, head.normals, np.zeros((len(nowhere), 9)), 1 - nowhere, nowhere, nowhere, None, np.ones(3))
    views, looks = [], []
    for seed, off in ((1, 0.3), (2, -0.2), (3, 0.0)):
        view = random_camera(template.landmark_points(mesh), 96, np.random.default_rng(seed))
        face, bary, _ = render_view(lit.caster, view)
        slope = np.linspace(-0.2, 0.2, 96, dtype=np.float32)[None, :, None] * (seed == 2)
        log = np.full((96, 96, 3), np.log(0.3), np.float32)
        shading = log - np.log(0.4) + np.float32(off) + slope
        views.append(view)
        looks.append(ShadingEstimate((0.0, 0.0, 96.0), shading, np.zeros((96, 96), np.float32), log, face, bary))
    even = even_out(lit, views, looks)

    def albedo(look):
        return (look.log - look.shading)[look.face >= 0]

    spread_before, spread_after = (np.std([np.median(albedo(look)) for look in each]) for each in (looks, even))
    assert spread_before > 0.15 and spread_after < 0.02
    assert albedo(even[1]).std() < 0.5 * albedo(looks[1]).std()


def slope(side: int = 40) -> np.ndarray:
    """A shading [S, S, 3] that is harmonic: it rises evenly, another way in each channel."""
    y, x = np.mgrid[0:side, 0:side] / side
    return np.stack([x - y, 0.3 * y + 0.1, 0.5 * x * y], -1)


def test_holes_in_a_harmonic_shading_come_back_exactly():
    hole = np.zeros((40, 40), bool)
    hole[10:20, 5:30], hole[30:34, 12:16] = True, True
    assert complete_shading(np.where(hole[..., None], 9.0, slope()), hole) == pytest.approx(slope(), abs=1e-9)
    corner = np.zeros((40, 40), bool)
    corner[:6, :6] = True
    level = np.full((40, 40, 3), 0.4)
    assert complete_shading(np.where(corner[..., None], 9.0, level), corner) == pytest.approx(level, abs=1e-9)
    for nothing_to_do in (np.zeros((40, 40), bool), np.ones((40, 40), bool)):
        assert np.array_equal(complete_shading(slope(), nothing_to_do), slope())


def test_the_cells_of_a_brow_and_those_beside_it_take_the_skins_shading():
    share = np.zeros((40, 40), np.float32)
    share[18:21, 10:30] = 0.9
    leaky = slope() - 2.0 * (share > 0)[..., None]
    leaky[17, 10:30] -= 1.0  # the answer is coarse: the row beside has a part of it
    assert fill_features(leaky, share) == pytest.approx(slope(), abs=0.02)
    assert np.array_equal(fill_features(leaky, np.full_like(share, 0.2)), leaky.astype(np.float32))


def test_below_hair_the_mean_of_both_answers_counts_at_the_level_of_the_skin_around():
    """A true shading that slopes; a beard that the network took for shadow; the fitted light is right but for its
    level."""
    y, x = np.mgrid[0:48, 0:48].astype(np.float32)
    true = np.repeat((-0.02 * x - 0.01 * y)[..., None], 3, -1)
    hair = (np.hypot(x - 24, y - 30) < 12).astype(np.float32)
    face = np.where(np.hypot(x - 24, y - 24) < 23, 0, -1)
    own = ShadingEstimate((0, 0, 48), true - 1.1 * hair[..., None], hair, true, face)
    expected = true - (1 - FITTED_SHARE) * 1.1 * hair[..., None]
    moved = ShadingEstimate((0, 0, 48), true - 0.3 * hair[..., None], hair, true, face)
    for look in (own, moved):  # below hair the network's own answer counts, however the look was moved on skin
        filled = fill_hair(look, own, true + 0.4, hair)
        assert np.abs(filled.shading - expected)[face >= 0].max() < 0.01 and filled.shadow[face >= 0].max() < 1e-6
        assert np.array_equal(filled.shading[face < 0], look.shading[face < 0])
    for share in (0 * hair, 1 + 0 * hair):  # no hair; nothing bare that would tell the level
        assert fill_hair(own, own, true, share) is own


def test_no_outline_of_a_shadow_stays_on_skin_and_its_pores_and_a_brow_do():
    """Even skin with pores, a brow, and a dark line as wide as the lift's blur along the edge of a shadow."""
    rng = np.random.default_rng(0)
    pores = 0.05 * rng.standard_normal((256, 256)).astype(np.float32)
    y, x = np.mgrid[0:256, 0:256]
    line = -0.3 * np.exp(-(((x - 130.5) / 4.0) ** 2)).astype(np.float32)
    brow = np.zeros((256, 256), np.float32)
    brow[60:80, 90:170] = -1.2
    share = (x < 131).astype(np.float32)
    log = np.repeat((pores + line + brow)[..., None], 3, -1)
    mended = (log - remove_seams(log, share, brow == 0, 12.0, 1.5))[..., 0]
    beside = np.s_[100:, 126:136]
    assert np.abs((mended - pores)[beside]).mean() < 0.25 * np.abs(line[beside]).mean()
    assert np.corrcoef(mended[beside].ravel(), pores[beside].ravel())[0, 1] > 0.85
    assert np.array_equal(mended[brow < 0], log[brow < 0][:, 0]), "the brow is not asked"
    assert np.array_equal(mended[:, :100], log[:, :100, 0]), "nor is what lies away from the edge"
    faint = log - remove_seams(log, 0.45 + 0.1 * share, brow == 0, 12.0, 1.5)
    assert np.abs(faint - log).max() < 0.12 * 0.3, "where the share hardly changes there may be no edge"


def test_a_frames_seams_are_taken_out_where_it_shows_skin():
    albedo = np.full((128, 128, 3), 0.5, np.float32)
    log = np.zeros((64, 64, 3), np.float32)
    log[:, 33:] = np.log(0.3)
    coarse = cv2.GaussianBlur(log, (0, 0), 1)
    srgb = images.linear_to_srgb(albedo * np.exp(cv2.resize(log, (128, 128), interpolation=cv2.INTER_NEAREST)))
    look = ShadingEstimate((0.0, 0.0, 128.0), coarse, (log[..., 0] < 0).astype(np.float32), np.zeros_like(log))
    skin = np.zeros((64, 64), np.float32)
    skin[:32] = 1
    came_out = images.srgb_to_linear(divide(srgb, look, skin)[0])[..., 1]
    off = np.abs(np.log(came_out / np.median(came_out)))[:, 56:76].mean(1)
    assert off[10:50].mean() < 0.8 * off[80:118].mean()


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
