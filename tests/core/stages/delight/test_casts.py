# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The hue of skin: one in light and shade, and the face's own where it is too dark to tell."""

import numpy as np
import pytest

from core.imaging import images
from core.stages.delight.casts import remove_casts, settle_dim_hues
from core.stages.delight.evening import ShadingEstimate


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
