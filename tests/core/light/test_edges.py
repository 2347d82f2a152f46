# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shadow's edge under a rough mask: found where it is, as wide as it is, and left alone where there is none."""

from itertools import product

import cv2
import numpy as np
import pytest

from core.light.shadow_edges import BAND_TEXELS, INWARD_TEXELS, penumbra, place
from core.solver.evidence import soften_mask

SIZE = 512
TAKEN = np.array([0.62, 0.55, 0.48])  # the share of the light that the shadow takes
MELANIN = np.array([0.5, 0.8, 1.0])  # what a mole takes of the skin's reflectance, natural log units


def shadowed(width, size=SIZE, centre=(0.655, 0.56), radius=90.0, grown=8, moved=(3, -3)):
    """(distance to the edge in texels of a 1024 map, positive outside; share of the shadow; a hard mask grown and moved
    by so many texels)."""
    texel = 1024 / size
    y, x = (np.mgrid[:size, :size] + 0.5) * texel
    distance = np.hypot(x - 1024 * centre[0], y - 1024 * centre[1]) - radius
    shadow = penumbra(distance, np.float32(max(width, texel)))
    painted = np.hypot(x - 1024 * centre[0] - moved[1], y - 1024 * centre[1] - moved[0]) < radius + grown
    return distance, shadow, painted.astype(np.float32)


def pores(size, strength=0.05):
    noise = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(size, size)), (0, 0), 1.0)
    return np.exp(strength * noise / noise.std())[..., None]


@pytest.mark.parametrize("width", [0, 2, 6, 12])
def test_alpha_lies_on_the_penumbra(width):
    distance, shadow, painted = shadowed(width)
    light = pores(SIZE) * (1 - shadow[..., None] * TAKEN)
    edge = place(light, soften_mask(painted), np.ones((SIZE, SIZE), np.float32), 2.0)
    near = np.abs(distance) < 25
    before, after = (np.abs(alpha - shadow)[near].mean() for alpha in (soften_mask(painted), edge.alpha))
    assert after < 0.01 and after < 0.1 * before
    assert np.abs(edge.alpha - shadow)[np.abs(distance) > width / 2 + 4].max() < 0.05  # no halo to either side
    assert np.abs(edge.colour - TAKEN / TAKEN.mean()).max() < 0.05
    assert edge.on_edge[np.abs(distance) < BAND_TEXELS - 2].min() > 0.9
    assert edge.on_edge[np.abs(distance) > BAND_TEXELS + 4].max() == 0


def test_an_edge_at_the_end_of_the_search_has_its_penumbra_and_deeper_all_stays():
    """The shadow ends 22 texels inside of what was painted, softly: alpha falls beyond 24, and not beyond 36."""
    depth = (np.arange(200) + 0.5 - 120) * 2.0 * np.ones((64, 1))
    shadow = penumbra(depth + 22, np.float32(19))[..., None]
    painted = (depth < 0).astype(np.float32)
    edge = place(pores(200)[:64] * (1 - shadow * TAKEN), painted, np.ones_like(painted), 2.0)
    assert edge.alpha[(depth < -INWARD_TEXELS) & (depth > -INWARD_TEXELS - 4)].mean() < 0.9
    assert edge.alpha[depth < -INWARD_TEXELS - BAND_TEXELS].min() == 1


def test_a_mask_without_a_shadow_stays_as_it_was_painted():
    painted = soften_mask(shadowed(0)[2])
    edge = place(pores(SIZE) * np.ones(3), painted, np.ones((SIZE, SIZE), np.float32), 2.0)
    assert np.array_equal(edge.alpha, painted) and edge.on_edge.max() == 0


def test_any_mask_gives_a_finite_alpha():
    light, ones = np.random.default_rng(0).uniform(0.2, 1, (64, 64, 3)), np.ones((64, 64), np.float32)
    one_texel = np.eye(64, dtype=np.float32) * (np.arange(64) == 30)
    for painted, weight in product((0 * ones, ones, one_texel), (0 * ones, ones)):
        alpha = place(light, painted, weight, 16.0).alpha
        assert np.isfinite(alpha).all() and alpha.min() >= 0 and alpha.max() <= 1


def test_a_step_of_another_colour_is_not_the_shadows():
    """The mask covers a shadow and, elsewhere, something brown such as a patch of hair: alpha goes to the shadow's edge
    and leaves the other alone."""
    _, shadow, painted = shadowed(2, centre=(0.7, 0.5))
    _, patch, around = shadowed(2, centre=(0.25, 0.5), radius=60.0)
    light = (1 - shadow[..., None] * TAKEN) * np.exp(-patch[..., None] * MELANIN)
    mask = soften_mask(np.maximum(painted, around))
    edge = place(light * pores(SIZE), mask, np.ones((SIZE, SIZE), np.float32), 2.0)
    left = np.arange(SIZE) < SIZE // 2
    assert np.abs(edge.alpha - shadow)[:, ~left].mean() < 0.1 * np.abs(mask - shadow)[:, ~left].mean()
    assert np.abs(edge.alpha - mask)[:, left].max() < 0.15


def test_deep_strokes_are_never_taken_back():
    """A lit island in the middle of a large stroke: the artist said shadow."""
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5) * 2
    away = np.hypot(x - 500, y - 500)
    shadow, painted = ((away < 200) & (away > 60)).astype(np.float32), soften_mask((away < 206).astype(np.float32))
    edge = place(1 - shadow[..., None] * TAKEN, painted, np.ones((SIZE, SIZE), np.float32), 2.0)
    assert edge.alpha[away < 206 - INWARD_TEXELS - BAND_TEXELS].min() == 1
