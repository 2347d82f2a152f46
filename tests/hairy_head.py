# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painted heads for the tests of the whole head and of hair: maps that are known everywhere, on the built-in head."""

from dataclasses import replace
from functools import cache

import numpy as np

from core.face import template
from core.stages.upscale.maps import HeadMaps
from core.stages.upscale.surface import HeadSurface, lay_out
from research.people.parameters import sample_parameters
from research.people.skin import make_skin

SIZE = 256


@cache
def surface() -> HeadSurface:
    return lay_out(template.load(), SIZE)


@cache
def painted(beard: float = 0.0, brows: float = 1.0) -> HeadMaps:
    """A subject without scalp hair, moles and freckles, seen all over."""
    skin = make_skin(
        replace(
            sample_parameters(4),
            beard=beard,
            beard_length=1.0,
            brow_density=brows,
            scalp_hair=0.0,
            moles=0.0,
            freckles=0.0,
        ),
        SIZE,
    )
    one = np.ones((SIZE, SIZE), np.float32)
    return HeadMaps(
        skin.diffuse.astype(np.float32),
        skin.normal.astype(np.float32),
        skin.specular,
        0.7 * one,
        np.repeat(one[..., None], 3, 2),
        one,
    )
