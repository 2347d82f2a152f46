# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers as arrays: told from what was painted and laid over again; healed spots have the tone and grain around them."""

import numpy as np
import pytest

pytest.importorskip("bpy")


@pytest.fixture
def pixels(addon):
    return addon("paint.layer_pixels")


@pytest.fixture
def healing(addon):
    return addon("paint.healing")


@pytest.fixture
def below():
    return np.random.default_rng(1).uniform(0.2, 0.7, (128, 128, 3)).astype(np.float32)


def brushed(below, hardness: float) -> np.ndarray:
    """Below with a round stroke of dark red, whose edge falls off over half of it at hardness 0."""
    row, column = np.mgrid[:128, :128]
    away = np.hypot(row - 60, column - 70) / 30
    cover = np.clip((1 - away) / max(1 - hardness, 1e-3), 0, 1)[..., None]
    return (below + cover * (np.array([0.4, 0.1, 0.1]) - below)).astype(np.float32)


@pytest.mark.parametrize("hardness", [0.0, 0.6, 1.0])
def test_a_layer_gives_back_what_was_painted_and_covers_nothing_else(pixels, below, hardness):
    painted = brushed(below, hardness)
    layer = pixels.tell_layer(painted, below, 3)
    assert np.abs(pixels.lay_over(below, layer) - painted).max() <= pixels.LEAST_CHANGE
    assert (layer[..., 3] > 0).sum() <= (np.abs(painted - below).max(-1) > 0).sum()
    assert layer.min() >= 0 and layer.max() <= 1
    assert layer[60, 70, 3] > 0.999, "inside it covers all"


def test_a_soft_stroke_fades_into_other_skin(pixels):
    """Over darker skin its edge is a slope, where that of a hard stroke is a step."""
    skin, other = (np.full((128, 128, 3), value, np.float32) for value in (0.5, 0.3))
    steps = {}
    for hardness in (0.0, 1.0):
        layer = pixels.tell_layer(brushed(skin, hardness), skin, 3)
        steps[hardness] = np.abs(np.diff(pixels.lay_over(other, layer)[60, :45], axis=0)).max()
    assert steps[0.0] < 0.06 and steps[1.0] > 0.15


@pytest.mark.parametrize("size", [32, 128, 200, 512])
def test_a_layer_of_another_size_has_no_foreign_colour_at_its_edge(pixels, size):
    layer = np.zeros((128, 128, 4), np.float32)
    layer[40:80, 40:80] = (0.8, 0.4, 0.2, 1)
    other = pixels.resized_layer(layer, size)
    assert other.shape == (size, size, 4)
    assert np.abs(other[other[..., 3] > 1e-3][:, :3] - (0.8, 0.4, 0.2)).max() < 1e-4
    assert np.isclose(other[..., 3].mean(), layer[..., 3].mean(), rtol=0.02)


def test_a_membrane_continues_a_ramp(healing):
    ramp = np.broadcast_to(np.linspace(0.2, 0.8, 96, dtype=np.float32)[None, :, None], (96, 96, 3)).copy()
    hole = np.zeros((96, 96), bool)
    hole[30:60, 40:70] = True
    spoilt = np.where(hole[..., None], 0, ramp)
    assert np.abs(healing.span_membrane(spoilt, hole) - ramp).max() < 0.02
    assert np.array_equal(healing.span_membrane(ramp, np.zeros_like(hole)), ramp)


def test_a_healed_spot_has_the_tone_and_the_grain_around_it(healing):
    rng = np.random.default_rng(2)
    skin = np.linspace(0.4, 0.6, 256)[:, None, None] + rng.normal(0, 0.02, (256, 256, 1)) * np.ones(3)
    row, column = np.mgrid[:256, :256]
    spot = np.hypot(row - 120, column - 130) < 14
    spoilt = np.where(spot[..., None], 0.1, skin).astype(np.float32)
    healed = healing.heal(spoilt, spot, 1024)
    assert np.array_equal(healed[:80], spoilt[:80]) and np.array_equal(healed[:, 190:], spoilt[:, 190:])
    assert abs((healed - skin)[spot].mean()) < 0.006
    assert 0.8 < healed[spot].std() / skin[spot].std() < 1.2


def test_spots_that_lie_apart_are_healed_one_by_one(healing):
    ramp = np.broadcast_to(np.linspace(0.2, 0.8, 400, dtype=np.float32)[None, :, None], (120, 400, 3)).copy()
    spots = np.zeros((120, 400), bool)
    spots[50:70, 60:80] = spots[50:70, 320:340] = True
    assert [part.sum() for part in healing.tell_apart(spots, 10)] == [400, 400]
    healed = healing.heal(np.where(spots[..., None], 0, ramp), spots, 1024)
    assert np.abs(healed - ramp).max() < 0.02
