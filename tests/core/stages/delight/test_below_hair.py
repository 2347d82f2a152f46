# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading below hair: filled from the skin around it, for hair's own colour is not light."""

import numpy as np
import pytest

from core.stages.delight.below_hair import FITTED_SHARE, complete_shading, fill_features, fill_hair
from core.stages.delight.evening import ShadingEstimate


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
