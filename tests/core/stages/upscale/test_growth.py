# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair where the face parser says there is some: beards dark, white and of stubble, and brows behind a fringe, against
the shares that were painted."""

from functools import cache

import cv2
import numpy as np
import pytest

from core.capture.capture import Capture
from core.face import shown_parts, template
from core.imaging import images
from core.stages.upscale import hair
from tests.fixtures.hairy_head import SIZE, beard_zone, maps_of, surface
from tests.fixtures.refused import refused

LIGHT, DARK = np.array([0.5, 0.35, 0.28]), np.array([0.07, 0.045, 0.035])
"""Skins, linear albedo."""
BLACK, WHITE = np.array([0.015, 0.012, 0.01]), np.array([0.5, 0.48, 0.45])
"""Hair."""


@cache
def regions() -> tuple[np.ndarray, np.ndarray]:
    """Where brows and beard are painted, bool [S, S]."""
    return template.mask("brows", SIZE) > 0.5, (beard_zone() > 0.9) & surface().covered


def strewn(where: np.ndarray, mean: float, spread: float, seed: int) -> np.ndarray:
    """A share of hair for each texel, [S, S]."""
    return where * np.clip(np.random.default_rng(seed).normal(mean, spread, (SIZE, SIZE)), 0, 1)


def found(skin: np.ndarray, layers: list[tuple[np.ndarray, np.ndarray]], parts: np.ndarray | None) -> hair.Hair:
    """What is found where layers of hair (share [S, S], colour [3]) lie over a skin of 2 % grain."""
    albedo = skin * (1 + 0.02 * np.random.default_rng(9).standard_normal((SIZE, SIZE, 1)))
    for share, colour in layers:
        albedo = albedo * (1 - share[..., None]) + share[..., None] * colour
    return hair.find(maps_of(albedo), surface(), parts)


def answer(brows: float = 0.0, beard: float = 0.0) -> np.ndarray:
    """A parser's answer that is so sure of each, [S, S, 3]."""
    where_brows, where_beard = regions()
    return np.stack([brows * where_brows, beard * where_beard, np.zeros((SIZE, SIZE))], -1).astype(np.float32)


@pytest.mark.parametrize(
    ("skin", "colour", "sure", "mean", "spread"),
    [
        (LIGHT, BLACK, 0.8, 0.4, 0.25),
        (DARK, WHITE, 0.8, 0.4, 0.25),
        (LIGHT, WHITE, 0.8, 0.4, 0.25),
        (LIGHT, BLACK, 0.3, 0.12, 0.05),
    ],
    ids=["dark beard", "white beard on dark skin", "white beard on light skin", "stubble"],
)
def test_a_beard_covers_as_much_as_was_painted(skin, colour, sure, mean, spread):
    """Within 0.06 in the mean, with black brows above it; nothing is found beside it."""
    where_brows, where = regions()
    brows, beard = strewn(where_brows, 0.6, 0.3, 1), strewn(where, mean, spread, 2)
    seen = found(skin, [(brows, BLACK), (beard, colour)], answer(0.8, sure))
    assert seen.beard[where].mean() == pytest.approx(beard[where].mean(), abs=0.06)
    assert np.corrcoef(seen.beard[where], beard[where])[0, 1] > 0.7
    assert seen.beard[~where].mean() < 0.005


def test_a_bare_chin_that_the_parser_doubts_has_no_beard_whatever_moles_it_has():
    where_brows, where = regions()
    mole = np.zeros((SIZE, SIZE))
    v, u = np.unravel_index(cv2.distanceTransform(where.astype(np.uint8), cv2.DIST_L2, 5).argmax(), where.shape)
    mole[v : v + 2, u : u + 2] = 1
    seen = found(LIGHT, [(strewn(where_brows, 0.6, 0.3, 1), BLACK), (mole, BLACK)], answer(0.8, 0.1))
    assert where[mole > 0].all() and seen.beard[where].mean() < 0.01 and seen.beard[mole > 0].max() < 0.1


def test_of_stubble_the_parser_is_as_sure_as_it_is_in_the_middle_of_it():
    """A shade without strokes, which it doubts all over and more so on the upper half."""
    where = regions()[1]
    upper = where & (np.mgrid[0:SIZE, 0:SIZE][0] < np.median(np.nonzero(where)[0]))
    parts = answer(brows=0.8, beard=0.6)
    parts[..., 1] = np.where(where, parts[..., 1], 0.08 * template.mask("face", SIZE))
    parts[upper, 1] = 0.35
    seen = found(LIGHT, [(strewn(regions()[0], 0.6, 0.3, 1), BLACK), (0.1 * where, BLACK)], parts)
    assert seen.beard[upper].mean() > 0.7 * seen.beard[where & ~upper].mean() > 0.03
    assert seen.beard[~where].mean() < 0.005


def test_hair_of_the_colour_of_its_skin_is_as_usual_where_the_parser_is_sure():
    where = regions()[0]
    seen = found(LIGHT, [], answer(brows=0.9))
    assert seen.brows[where].mean() == pytest.approx(hair.USUAL_COVER["brows"], abs=0.15)
    assert found(LIGHT, [], None).brows.max() == 0


@pytest.mark.parametrize("both", [False, True], ids=["one side", "both sides"])
def test_brows_behind_a_fringe_are_like_the_other_one_or_as_usual(both):
    """A fringe over the forehead and one brow, or both: no hair of it becomes a brow."""
    where = regions()[0]
    v, u = np.mgrid[0:SIZE, 0:SIZE]
    forehead = (v < np.nonzero(where)[0].max() + 3) & (template.mask("face", SIZE) > 0.5) & (both | (u < SIZE // 2))
    brows, fringe = strewn(where, 0.35, 0.35, 1), strewn(forehead, 0.8, 0.3, 2)
    parts = answer(brows=0.8)
    parts[forehead] = [0, 0, 0.95]
    seen = found(LIGHT, [(brows, BLACK), (fringe, BLACK)], parts)
    hidden = where & forehead
    usual = hair.USUAL_COVER["brows"] if both else brows[where & ~forehead].mean()
    assert seen.brows[hidden].mean() == pytest.approx(usual, abs=0.1)
    assert seen.brows[forehead & ~where].mean() < 0.02 and seen.hidden[hidden].min() > 0.99


def test_the_parts_of_a_capture_are_read_at_the_size_of_its_maps(tmp_path):
    capture = Capture(tmp_path / "a.wildcap")
    assert shown_parts.read_parts(capture, 32) is None
    images.write_data(capture.texture_parts, np.full((64, 64, 3), [0.2, 0.4, 0.6], np.float32))
    assert shown_parts.read_parts(capture, 32) == pytest.approx(np.full((32, 32, 3), [0.2, 0.4, 0.6]), abs=0.005)
    images.write_data(capture.texture_parts, np.full((64, 64), 0.5, np.float32))
    refused(lambda: shown_parts.read_parts(capture, 32), "parts of a face that grow hair")
