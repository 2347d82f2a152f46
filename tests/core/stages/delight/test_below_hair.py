# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light knows no brows: what the network says of them is replaced by what it says of the skin around."""

from dataclasses import replace

import numpy as np
import pytest

from core.stages.delight.below_hair import complete_shading, fill_features, fill_hair
from core.stages.delight.evening import ShadingEstimate


def slope(side: int = 40) -> np.ndarray:
    """A shading [S, S, 3] that is harmonic: it rises evenly, another way in each channel."""
    y, x = np.mgrid[0:side, 0:side] / side
    return np.stack([x - y, 0.3 * y + 0.1, 0.5 * x * y], -1)


def test_a_hole_in_a_harmonic_shading_comes_back_exactly():
    hole = np.zeros((40, 40), bool)
    hole[10:20, 5:30], hole[30:34, 12:16] = True, True
    assert complete_shading(np.where(hole[..., None], 9.0, slope()), hole) == pytest.approx(slope(), abs=1e-9)


def test_a_hole_at_the_border_and_no_hole_at_all():
    hole = np.zeros((40, 40), bool)
    hole[:6, :6] = True
    found = complete_shading(np.where(hole[..., None], 9.0, np.float64(0.4) + 0 * slope()), hole)
    assert found == pytest.approx(0.4, abs=1e-9)
    assert complete_shading(slope(), np.zeros((40, 40), bool)) is not None
    assert np.array_equal(complete_shading(slope(), np.ones((40, 40), bool)), slope())


def test_the_cells_of_a_brow_and_those_beside_it_take_the_skins_shading():
    share = np.zeros((40, 40), np.float32)
    share[18:21, 10:30] = 0.9
    leaky = slope() - 2.0 * (share > 0)[..., None]
    leaky[17, 10:30] -= 1.0  # the answer is coarse: the row beside has a part of it
    assert fill_features(leaky, share) == pytest.approx(slope(), abs=0.02)
    assert np.array_equal(fill_features(leaky, np.full_like(share, 0.2)), leaky.astype(np.float32))


def test_below_hair_the_mean_of_network_and_fit_counts_however_far_the_fit_counts_on_skin():
    side = 20
    share = np.zeros((side, side), np.float32)
    share[8:12, 8:12] = 1
    here, even = np.zeros((side, side), int), np.zeros((side, side, 3), np.float32)
    own = ShadingEstimate((0, 0, side), np.where(share[..., None] > 0, 0.4, even), share, even, here)
    fitted = np.where(share[..., None] > 0, -0.2, even) - 1  # at another level, as its tone is a guess
    for weight in (0.0, 0.6):
        weighed = replace(own, shading=own.shading + weight * (fitted + 1 - own.shading))
        filled = fill_hair(weighed, own, fitted, share)
        assert filled.shading[10, 10] == pytest.approx(0.1, abs=1e-6)
        assert filled.shading[2, 2] == pytest.approx(0, abs=1e-6)
        assert filled.shadow[10, 10] == pytest.approx(0, abs=1e-6)
