# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighting network and what surrounds it: its input, two answers put together, and division."""

import importlib
import json

import cv2
import numpy as np
import pytest
import torch

from core.imaging import images
from core.stages.delight.evening import ShadingEstimate
from core.stages.delight.lit_head import MAX_ALBEDO
from core.stages.delight.network import WEIGHTS, crop, divide, load_network, square_around
from core.stages.delight.second_opinion import Weighing, continue_beyond, weigh_in
from core.stages.delight.unet import BIN_LOG, network_input, slice_grid
from research.people.identities import reserved_seeds
from tests.fixtures.refused import refused


def test_a_crop_finds_a_place_again():
    y, x = np.mgrid[0:200, 0:300].astype(np.float32) + 0.5
    picture = np.dstack([x, y])
    box = (50.0, 20.0, 120.0)
    for size in (240, 60, 30):
        cut = crop(picture, box, size)
        at = (np.arange(size) + 0.5) * 120 / size
        assert np.abs(cut[size // 2, 2:-2, 0] - (50 + at[2:-2])).max() < 0.1
        assert np.abs(cut[2:-2, size // 2, 1] - (20 + at[2:-2])).max() < 0.1
    left, top, side = square_around(np.array([[100, 50], [140, 90.0]]))
    assert (left + side / 2, top + side / 2) == pytest.approx((120, 70)) and side > 40


def test_a_grid_is_read_by_the_luminance_about_its_mean():
    """Beside an edge the two sides lie in bins of their own; on even ground the middle bin counts, at any size."""
    value = torch.tensor([-1.0, 0.0, 1.0])
    grid = value.view(1, 1, 3, 1, 1).expand(1, 1, 3, 16, 16)
    even = torch.full((1, 3, 48, 80), -2.0)
    assert slice_grid(grid, even).abs().max() < 1e-5
    edge = even.clone()
    edge[..., 40:] += 2 * BIN_LOG
    answer = slice_grid(grid, edge)[0, 0, 24]
    assert answer[39] == pytest.approx(-1, abs=0.12) and answer[40] == pytest.approx(1, abs=0.12)
    assert answer[[0, -1]].abs().max() < 1e-5
    ramp = torch.linspace(0, 1, 16).expand(1, 1, 1, 16, 16)
    centres = (np.arange(48) + 0.5) / 48 * 16 - 0.5
    expected = np.interp(centres, np.arange(16), np.linspace(0, 1, 16))
    assert np.allclose(slice_grid(ramp, torch.zeros(1, 3, 48, 48))[0, 0, 0], expected, atol=1e-5), "one bin is a map"


def test_the_input_does_not_know_the_exposure():
    linear = np.random.default_rng(0).uniform(0.05, 0.4, (64, 64, 3)).astype(np.float32)
    (one, middle), (other, brighter) = (network_input(images.linear_to_srgb(gain * linear)) for gain in (1, 2))
    assert brighter - middle == pytest.approx(np.log(2), abs=1e-3)
    assert np.abs(one[3:6] - other[3:6]).max() < 1e-3 and not one[6:].any()


def test_geometry_enters_as_what_it_leaves_unexplained():
    srgb = np.full((64, 64, 3), 0.5, np.float32)
    light = images.srgb_to_linear(srgb) / np.e
    head = np.zeros((64, 64), np.float32)
    head[:, :32] = 1
    layers, _ = network_input(srgb, light, light, np.zeros((64, 64, 3), np.float32), head)
    assert layers[6:12, :, :32] == pytest.approx(1, abs=1e-3)
    assert not layers[6:12, :, 32:].any() and layers[15, 0, 0] == 1


def test_beyond_the_square_the_fitted_light_takes_over_at_the_same_level():
    """A scalp that the network's square does not reach: there its border's shading gives way to the fit's, whose level
    is another."""
    shading, shadow = np.full((40, 30, 3), -0.5, np.float32), np.zeros((40, 30), np.float32)
    confidence = np.zeros((40, 30), np.float32)
    confidence[15:] = 1
    light = np.exp(np.full((40, 30, 3), 1.5, np.float32))  # 2 above the network's
    light[:10] *= np.float32(0.3)
    share, on_head = np.ones((40, 30), np.float32), np.ones((40, 30), bool)
    share[:10] = 0
    box = (slice(0, 40), slice(0, 30))
    whole, dark = continue_beyond(shading, shadow, confidence, box, light, share, on_head)
    assert whole[10:] == pytest.approx(-0.5, abs=1e-5) and whole[:10] == pytest.approx(-0.5 + np.log(0.3), abs=1e-5)
    assert dark[:10] == pytest.approx(1) and not dark[10:].any()
    same, _ = continue_beyond(shading, shadow, np.zeros_like(confidence), box, light, share, on_head)
    assert np.array_equal(same, shading)  # nothing to take the level from


@pytest.mark.parametrize(("skin", "expected"), [(0.4, 0.4), (1.7, MAX_ALBEDO)])
def test_how_bright_a_frame_came_out_is_judged_by_its_skin_and_not_by_the_wall_behind(skin, expected):
    """A face over a third of its square before a wall that is white in sun, under a light of a half: skin as people
    have it stays, skin brighter than any is brought down to the brightest."""
    light, face, nothing = 0.5, np.zeros((32, 32), np.float32), np.zeros((32, 32, 3), np.float32)
    face[4:28, 9:23] = 1
    large = cv2.resize(face, (96, 96), interpolation=cv2.INTER_NEAREST)[..., None]
    srgb = images.linear_to_srgb(np.where(large > 0, skin * light, np.float32([0.9, 0.95, 1.0])))
    look = ShadingEstimate((0, 0, 96), nothing + np.float32(np.log(light)), 0 * face, nothing)
    albedo, _ = divide(srgb, look, face)
    assert images.srgb_to_linear(albedo)[36:60, 40:56] == pytest.approx(expected, rel=0.01)


def test_missing_weights_are_named(monkeypatch, tmp_path):
    module = importlib.import_module("core.stages.delight.network")  # the package has a function of that name
    monkeypatch.setattr(module, "WEIGHTS", tmp_path / "delighter.safetensors")
    refused(lambda: load_network("cpu"), "weights ", " missing")


def test_the_shipped_network_is_the_one_its_card_describes():
    card = json.loads(WEIGHTS.with_suffix(".json").read_text(encoding="utf-8"))
    net = load_network("cpu")
    assert sum(v.numel() for v in net.parameters()) == card["parameters"] and WEIGHTS.stat().st_size < 15e6
    assert not set(card["seeds"]) & (set(card["held_out_seeds"]) | set(reserved_seeds()))
    assert not set(card["skins"]) & set(card["held_out_skins"])
    assert card["held_out"]["geometry"] < card["held_out"]["picture"] < 0.5 * card["held_out"]["none"]


def test_two_answers_are_weighed_by_how_far_they_lie_apart_over_the_skin_of_a_capture():
    face, skin = np.zeros((32, 32), int), np.ones((32, 32), np.float32)
    face[:, 28:] = -1
    skin[12:16] = 0  # lips: the network may take them for shade, which says nothing against the fit
    look = ShadingEstimate((0, 0, 32), np.zeros((32, 32, 3), np.float32), skin, np.zeros((32, 32, 3), np.float32), face)
    weighing = Weighing(share=0.6, doubt=0.2)
    for apart, weight in ((0.001, 0.6), (0.2, 0.3), (5.0, 0.0)):
        answer = np.full((32, 32, 3), 5, np.float32)  # a level is no difference
        answer[::2], answer[1::2] = answer[::2] + apart, answer[1::2] - apart
        answer[12:16] = 6
        (both,) = weigh_in([look], [answer], [skin], weighing)
        assert both.shading[:12:2, :28] == pytest.approx(weight * apart, rel=0.01, abs=0.01)
        assert both.shading[12:16, :28] == pytest.approx(weight, rel=0.01, abs=0.01)
        assert not both.shading[:, 28:].any(), "off the head"
    assert weigh_in([look], [answer], [0 * skin], weighing) == [look], "no skin tells the level"
