# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import numpy as np
import pytest

from research.people.response import curves, local_gain

SIDE = 128


@pytest.mark.parametrize("seed", range(4))
def test_local_tone_mapping_moves_a_large_shadow_and_leaves_fine_pigment(seed):
    columns, rows = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    shadow, stripes = np.where(columns < SIDE // 2, np.log(0.25), 0.0), 0.05 * (-1.0) ** rows
    mapped = np.log(local_gain(0.4 * np.exp(shadow + stripes)[..., None].repeat(3, 2), np.random.default_rng(seed)))
    mapped = mapped[..., 0] + shadow + stripes
    dark, light = mapped[:, : SIDE // 4], mapped[:, -SIDE // 4 :]
    step = light.mean() - dark.mean()
    assert 0.5 * np.log(4) < step < 1.2 * np.log(4) and abs(step - np.log(4)) > 0.01
    for half in dark, light:
        assert half[0::2].mean() - half[1::2].mean() == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_a_picture_and_the_same_without_pigment_share_their_tone_mapping(seed):
    rng = np.random.default_rng(9)
    even = np.exp(rng.normal(-1.5, 0.3, (SIDE, SIDE, 3)))
    picture, alike = curves(even, even, np.random.default_rng(seed))
    assert np.array_equal(picture, alike)
    dyed, below = curves(0.5 * even, even, np.random.default_rng(seed))
    assert (dyed < below).all()
