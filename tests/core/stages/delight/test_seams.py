# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of shadows that dividing by a blurred answer leaves in a delit frame."""

import cv2
import numpy as np

from core.imaging import images
from core.stages.delight.evening import ShadingEstimate
from core.stages.delight.network import divide
from core.stages.delight.occlusion import remove_seams


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
