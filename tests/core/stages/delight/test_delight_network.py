# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighting network and what surrounds it: input, lifting along edges, training that goes on."""

import importlib
import json

import cv2
import numpy as np
import pytest
import torch

from core.capture.messages import Problem, Reporter
from core.geometry.meshes import vertex_normals
from core.imaging import images
from core.stages.delight.below_hair import FITTED_SHARE, fill_hair
from core.stages.delight.evening import ShadingEstimate
from core.stages.delight.lift import lift_shading, lift_share
from core.stages.delight.lit_head import MAX_ALBEDO
from core.stages.delight.network import WEIGHTS, crop, divide, load_network, square_around
from core.stages.delight.second_opinion import Weighing, continue_beyond, weigh_in
from core.stages.delight.unet import CHANNELS, DelightNet, network_input
from research.people.identities import reserved_seeds
from research.people.sight import random_camera
from research.training import delighter, people
from research.training.descent import TrainingRun

QUIET = Reporter("train", emit=lambda message: None)


def test_a_lifted_shadow_edge_lies_where_the_picture_has_it():
    """Skin with pores, and a shadow whose edge falls inside a coarse cell: the coarse answer blurs it, the lifted one
    does not, and no pore passes into it."""
    rng = np.random.default_rng(0)
    pores = 0.05 * cv2.GaussianBlur(rng.standard_normal((256, 256)).astype(np.float32), (0, 0), 0.8) / 0.35
    shading = np.zeros((256, 256), np.float32)
    shading[:, 101:] = -1.2
    coarse = cv2.resize(shading, (64, 64), interpolation=cv2.INTER_AREA)
    log = np.repeat((shading + pores - 1)[..., None], 3, -1)
    lifted = lift_shading(np.repeat(coarse[..., None], 3, -1), log)[..., 0]
    plain = cv2.resize(coarse, (256, 256), interpolation=cv2.INTER_LINEAR)
    edge = slice(97, 105)
    assert np.abs(lifted - shading)[:, edge].mean() < 0.35 * np.abs(plain - shading)[:, edge].mean()
    assert np.abs(lifted - shading)[:, :80].mean() < 0.02
    left = (log[..., 0] - lifted)[:, 10:90]
    assert np.corrcoef(left.ravel(), pores[:, 10:90].ravel())[0, 1] > 0.98


def test_a_lifted_share_stays_a_share():
    share = np.zeros((32, 32), np.float32)
    share[:, 16:] = 1
    log = np.repeat(-2 * cv2.resize(share, (128, 128), interpolation=cv2.INTER_NEAREST)[..., None], 3, -1)
    lifted = lift_share(share, log)
    assert lifted.min() >= 0 and lifted.max() <= 1
    assert (
        lifted[:, :52].max() < 0.05
        and lifted[:, 76:].min() > 0.95
        and lifted[:, 63].mean() < 0.35
        and lifted[:, 64].mean() > 0.65
    )


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


def test_the_input_does_not_know_the_exposure():
    rng = np.random.default_rng(0)
    linear = rng.uniform(0.05, 0.4, (64, 64, 3)).astype(np.float32)
    (one, middle), (other, brighter) = (
        network_input(images.linear_to_srgb(linear)),
        network_input(images.linear_to_srgb(2 * linear)),
    )
    assert brighter - middle == pytest.approx(np.log(2), abs=1e-3)
    assert np.abs(one[3:6] - other[3:6]).max() < 1e-3 and not one[6:].any()


def test_geometry_is_told_as_what_it_leaves_unexplained():
    srgb = np.full((64, 64, 3), 0.5, np.float32)
    light = np.repeat(images.srgb_to_linear(srgb) / np.e, 1, -1)
    head = np.zeros((64, 64), np.float32)
    head[:, :32] = 1
    layers, _ = network_input(srgb, light, light, np.zeros((64, 64, 3), np.float32), head)
    assert layers[6:12, :, :32] == pytest.approx(1, abs=1e-3)
    assert not layers[6:12, :, 32:].any() and layers[15, 0, 0] == 1


def test_an_untrained_network_says_nothing_and_sees_any_size():
    net = DelightNet([16, 16, 16, 16], [1, 1, 1, 1])
    for side in (64, 96):
        shading, shadow = net(torch.randn(1, CHANNELS, side, side))
        assert shading.shape == (1, 3, side // 2, side // 2) and not shading.any() and not shadow.any()


def test_beyond_the_square_the_fitted_light_takes_over_at_the_same_level():
    """A scalp that the network's square does not reach: there its border's shading gives way to the fit's, whose level
    is another."""
    shading, shadow = np.full((40, 30, 3), -0.5, np.float32), np.zeros((40, 30), np.float32)
    known = np.zeros((40, 30), np.float32)
    known[15:] = 1
    light = np.exp(np.full((40, 30, 3), 1.5, np.float32))  # 2 above the network's
    light[:10] *= np.float32(0.3)
    share, here = np.ones((40, 30), np.float32), np.ones((40, 30), bool)
    share[:10] = 0
    box = (slice(0, 40), slice(0, 30))
    whole, dark = continue_beyond(shading, shadow, known, box, light, share, here)
    assert whole[10:] == pytest.approx(-0.5, abs=1e-5) and whole[:10] == pytest.approx(-0.5 + np.log(0.3), abs=1e-5)
    assert dark[:10] == pytest.approx(1) and not dark[10:].any()
    same, _ = continue_beyond(shading, shadow, np.zeros_like(known), box, light, share, here)
    assert np.array_equal(same, shading)  # nothing to take the level from


@pytest.mark.parametrize(("skin", "expected"), [(0.4, 0.4), (1.7, MAX_ALBEDO)])
def test_how_bright_a_frame_came_out_is_told_by_its_skin_and_not_by_the_wall_behind(skin, expected):
    """A face over a third of its square before a wall that is white in sun, under a light of a half: skin as people
    have it stays, skin brighter than any is brought down to the brightest."""
    light, face = 0.5, np.zeros((32, 32), np.float32)
    face[4:28, 9:23] = 1
    linear = np.where(
        cv2.resize(face, (96, 96), interpolation=cv2.INTER_NEAREST)[..., None] > 0,
        skin * light,
        np.float32([0.9, 0.95, 1.0]),
    )
    srgb = images.linear_to_srgb(np.broadcast_to(linear, (96, 96, 3)))
    look = ShadingEstimate(
        (0, 0, 96),
        np.full((32, 32, 3), np.log(light), np.float32),
        0 * face,
        np.zeros((32, 32, 3), np.float32),
        np.where(face > 0, 0, -1),
    )
    albedo, _ = divide(srgb, look, face)
    assert images.srgb_to_linear(albedo)[36:60, 40:56] == pytest.approx(expected, rel=0.01)


def test_missing_weights_are_named(monkeypatch, tmp_path):
    module = importlib.import_module("core.stages.delight.network")  # the package has a function of that name
    monkeypatch.setattr(module, "WEIGHTS", tmp_path / "delighter.safetensors")
    with pytest.raises(Problem, match="weights of the delighting network are missing"):
        load_network("cpu")


def test_the_shipped_network_is_the_one_its_card_tells_of():
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
        answer = np.zeros((32, 32, 3), np.float32) + 5  # a level is no difference
        answer[::2], answer[1::2] = answer[::2] + apart, answer[1::2] - apart
        answer[12:16] = 6
        (both,) = weigh_in([look], [answer], [skin], weighing)
        assert both.shading[:12:2, :28] == pytest.approx(weight * apart, rel=0.01, abs=0.01)
        assert both.shading[12:16, :28] == pytest.approx(weight, rel=0.01, abs=0.01)
        assert not both.shading[:, 28:].any(), "off the head"
    assert weigh_in([look], [answer], [0 * skin], weighing) == [look], "no skin tells the level"


def test_below_hair_the_mean_of_both_answers_counts_at_the_level_of_the_skin_around():
    """A true shading that slopes; a beard that the network took for shadow; the fitted light is right but for its
    level."""
    y, x = np.mgrid[0:48, 0:48].astype(np.float32)
    true = np.repeat((-0.02 * x - 0.01 * y)[..., None], 3, -1)
    hair = (np.hypot(x - 24, y - 30) < 12).astype(np.float32)
    face = np.where(np.hypot(x - 24, y - 24) < 23, 0, -1)
    look = ShadingEstimate((0, 0, 48), true - 1.1 * hair[..., None], hair, true, face)
    told = fill_hair(look, look, true + 0.4, hair)
    expected = true - (1 - FITTED_SHARE) * 1.1 * hair[..., None]
    assert np.abs(told.shading - expected)[face >= 0].max() < 0.01 and told.shadow[face >= 0].max() < 1e-6
    assert np.array_equal(told.shading[face < 0], look.shading[face < 0])
    assert fill_hair(look, look, true, 0 * hair) is look
    assert fill_hair(look, look, true, 1 + 0 * hair) is look, "nothing is bare that would tell the level"


def test_a_training_goes_on_where_it_stopped(monkeypatch, tmp_path):
    small = {
        "model": {"widths": [16, 16, 16, 16], "depths": [1, 1, 1, 1]},
        "training": {
            "pairs": 1,
            "echo": 2,
            "rate": 1e-3,
            "minutes": 1,
            "skins": 1,
            "people": 1,
            "views": 1,
            "held_out": 1,
            "seed": 0,
            "workers": 0,
        },
    }
    monkeypatch.setitem(delighter.CONFIGS, "cpu", small)
    monkeypatch.setattr(delighter, "prepare", lambda seeds, views, work, *rest: _prepared(seeds, work))

    def prepare(seeds, views, work, *rest):
        for seed in seeds:
            if not people.is_prepared(seed, views, work):
                people._prepare_one((seed, views, work))

    # here and of small maps; that processes of their own prepare people is tested in test_people_portraits.py
    monkeypatch.setattr(delighter, "prepare_people", prepare)
    monkeypatch.setattr(people, "TEXELS", 256)
    with pytest.raises(Problem, match="There are no people in"):
        delighter.train_delighter(
            "cpu", tmp_path / "out.safetensors", QUIET, TrainingRun(growing=True, work=tmp_path / "work")
        )
    out = tmp_path / "out.safetensors"
    first = delighter.train_delighter("cpu", out, QUIET, TrainingRun(0.01, tmp_path / "work"))
    second = delighter.train_delighter("cpu", out, QUIET, TrainingRun(0.02, tmp_path / "work"))
    assert second["steps"] > first["steps"] > 0 and second["started"] == "random weights" and len(second["people"]) == 1
    begun = delighter.train_delighter(
        "cpu", tmp_path / "third.safetensors", QUIET, TrainingRun(0.01, _emptied(tmp_path / "work"), start=out)
    )
    assert begun["started"] == "the weights before"
    assert json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))["held_out"]["none"] > 0
    assert not set(second["seeds"]) & set(second["held_out_seeds"])


def _emptied(work):
    """A folder with what was prepared and no training."""
    (work / "state.pt").unlink()
    return work


def _prepared(seeds, work):
    """Sights of subjects with plain skin: what `prepare` makes in seconds, in tenths of one."""
    from core.stages.delight.unet import SIDE_PX
    from research.people import olat, sight
    from research.people.identities import subject_mesh

    for seed in seeds:
        place = work / f"subject_{seed}"
        if place.is_dir():
            continue
        place.mkdir(parents=True)
        mesh = subject_mesh(seed)
        stage = olat.LightStage(
            mesh, vertex_normals(mesh).astype(np.float32), np.ones((len(mesh.vertices), olat.LIGHTS), bool)
        )
        np.save(place / "visible.npy", np.packbits(stage.visible, axis=1))
        plain = np.broadcast_to(np.float32([0, 0, 1]), (64, 64, 3))
        view = random_camera(sight.landmarks_of(stage), SIDE_PX, np.random.default_rng(seed))
        diffuse, gloss = np.full((64, 64, 3), 0.3, np.float32), np.full((64, 64), 0.03, np.float32)
        sight.save(place / "0.npz", sight.trace_sight(stage, view, diffuse, gloss, plain, np.random.default_rng(seed)))
