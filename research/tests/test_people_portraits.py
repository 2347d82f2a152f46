# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The people that a delighter learns from: their light must know nothing of what grows on them or of what colour they
are."""

from dataclasses import fields

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.face.parts import PARTS
from core.imaging import images
from core.stages.delight.unet import FARTHEST_LOG, network_input
from research.people.lifelike import markings, portraits, relightable
from research.people.lifelike.figure import make_figure
from research.training import people
from research.training.portraits import LEAST_WEIGHT, PortraitBatch, repainted
from research.training.sights import SightStore, Source, stack_examples

QUIET = Reporter("train", emit=lambda message: None)
BEARDED = 1010


@pytest.fixture(scope="module")
def stage():
    sitter = relightable.Sitter(make_figure(BEARDED, 256), np.random.default_rng(0))
    return next(
        s
        for s in (sitter.stage(np.random.default_rng(seed)) for seed in range(9))
        if share(s, "beard").sum() > 150 and share(s, "brows").sum() > 100
    )


def share(stage: relightable.RelightableView, name: str) -> np.ndarray:
    return stage.unlit.shares[..., PARTS.index(name)].astype(np.float32) / 255


def contrast(picture: np.ndarray, stage: relightable.RelightableView) -> float:
    """How much darker brows and beard are than the skin, natural log of the mean channel."""
    log = np.log(np.maximum(picture.mean(-1), 1e-3))
    grown, skin = share(stage, "brows") + share(stage, "beard"), share(stage, "skin")
    return float(log[skin > 0.95].mean() - log[grown > 0.9].mean())


def test_a_sight_comes_back_as_it_was_kept(stage, tmp_path):
    relightable.save(tmp_path / "0.npz", stage)
    back = relightable.load(tmp_path / "0.npz")
    for one, other in ((stage, back), (stage.unlit, back.unlit)):
        names = [field.name for field in fields(one) if field.name != "unlit"]
        assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_light_does_not_know_the_pigment(stage):
    """Two people of the same shape under the same light, one with a black beard and brows and a blotch: their light is
    the same, exposure apart."""
    shares = stage.unlit.shares.astype(np.float32) / 255
    shares /= np.maximum(shares.sum(-1, keepdims=True), 1e-6)
    plain = portraits.Colours(np.full((*stage.here.shape, 3), 0.4, np.float32), shares)
    dark = plain.albedo * np.exp(-2 * (share(stage, "beard") + share(stage, "brows")))[..., None]
    dark[100:130, 100:130] *= np.float32([0.6, 0.4, 0.4])
    made = [
        portraits.portray(stage, portraits.Colours(albedo, shares), np.random.default_rng(4))
        for albedo in (plain.albedo, dark)
    ]
    pictures = [images.srgb_to_linear(portrait.srgb) for portrait in made]
    assert contrast(pictures[1], stage) - contrast(pictures[0], stage) > 0.8
    known = (made[0].skin > 0.99) & (made[1].skin > 0.99) & (made[0].even.min(-1) > 0.02)
    apart = np.log(made[1].even[known]) - np.log(made[0].even[known])
    lit = np.log(made[0].even[known])
    assert known.sum() > 2000 and lit.std() > 0.15 and (apart - np.median(apart, 0)).std() < 0.1 * lit.std()


def test_brows_and_beard_are_lit_as_the_bare_head_is(stage):
    colours = portraits.colours_of(stage, np.random.default_rng(1))
    slopes, strands = [], []
    for seed in range(6):
        made = portraits.portray(stage, colours, np.random.default_rng(seed))
        grown = (share(stage, "brows") + share(stage, "beard") > 0.9) & stage.here & (made.head > 0.99)
        shading = images.srgb_to_linear(made.srgb).mean(-1) / np.maximum(made.albedo.mean(-1), 0.004)
        for picture, kept in ((made.even.mean(-1), slopes), (shading, strands)):
            kept.append(np.abs(np.diff(np.log(np.maximum(picture, 0.02)), axis=1))[:, :-1][grown[:, 1:-1]])
    assert np.median(np.concatenate(slopes)) < 0.5 * np.median(np.concatenate(strands))  # no strand is seen in it


def test_batches_show_each_sight_under_two_lights_and_depend_on_the_seed_alone(tmp_path):
    store = SightStore(tmp_path, "person", 1)
    store.prepare([BEARDED], people.make_sights, QUIET, processes=2)
    source = Source(store, [BEARDED], people.shoot)
    drawn = [stack_examples(PortraitBatch, source.draw(1, np.random.default_rng(3))) for _ in range(2)]
    assert all(map(torch.equal, *drawn))
    batch = drawn[0]
    assert batch.layers.shape[0] == 2 and not np.allclose(batch.shading[0], batch.shading[1], atol=0.1)
    albedo = batch.layers[:, 3:6] - batch.shading
    both = (batch.weight[0] * batch.weight[1])[0] > 0.9
    left = (albedo[0] - albedo[1])[:, both]
    light = (batch.shading[0] - batch.shading[1])[:, both]
    assert (left - left.mean(1, keepdim=True)).abs().mean() < 0.6 * (light - light.mean(1, keepdim=True)).abs().mean()


def test_a_face_that_is_painted_over_keeps_its_light():
    """Two lights on one albedo, half of it skin; the fitted light is the true one."""
    side, rng = 64, np.random.default_rng(0)
    albedo = np.full((side, side, 3), [0.35, 0.25, 0.2], np.float32)
    lights = [
        np.linspace(0.3, 1.0, side, dtype=np.float32)[:, None, None] * np.ones((side, side, 3), np.float32) * tint
        for tint in (1.0, 0.8)
    ]
    skin = np.zeros((1, side, side), np.float32)
    skin[..., : side // 2] = 1
    told = [
        network_input(
            images.linear_to_srgb(albedo * light),
            0.3 * light,
            0.3 * light,
            np.ones((side, side, 3), np.float32),
            np.ones((side, side), np.float32),
        )
        for light in lights
    ]
    shading = [np.log(light).transpose(2, 0, 1) - middle for light, (_, middle) in zip(lights, told, strict=True)]
    weight = np.stack([LEAST_WEIGHT + (1 - LEAST_WEIGHT) * skin] * 2)
    batch = PortraitBatch(
        *(
            torch.from_numpy(np.stack(maps).astype(np.float32))
            for maps in (
                [layers for layers, _ in told],
                shading,
                weight,
                0 * weight,
                0 * weight,
                np.zeros((2, 1, 1, 1)),
            )
        )
    )
    moved = 0.0
    for _ in range(6):
        painted = repainted(batch, rng)
        linear, before = (
            images.srgb_to_linear((maps.layers[:, :3].numpy().transpose(0, 2, 3, 1) + 1) / 2)
            for maps in (painted, batch)
        )
        paint = np.log(linear / before)
        assert np.allclose(paint[0], paint[1], atol=2e-3)  # one albedo under both lights
        assert np.allclose(paint[:, :, side // 2 :], 0, atol=1e-4)  # nothing off the skin
        middles = [network_input(images.linear_to_srgb(picture))[1] for picture in linear]
        for k, light in enumerate(lights):
            there = painted.shading[k].numpy().transpose(1, 2, 0) + middles[k]
            assert np.allclose(there, np.log(light), atol=2e-3)
            rest = np.clip(np.log(linear[k]) - np.log(0.3 * light), -FARTHEST_LOG, FARTHEST_LOG)
            assert np.allclose(painted.layers[k, 6:9].numpy().transpose(1, 2, 0), rest, atol=2e-3)
        moved = max(moved, float(np.abs(paint).max()))
    assert moved > 0.3


def test_stains_with_a_hard_edge_are_dyes():
    """A grey patch with a hard edge is what a leaf's shadow looks like; a dye leaves one channel as it is."""
    dyes, steps = [], []
    for seed in range(40):
        log = np.abs(markings.stains(256, np.random.default_rng(seed)))
        dyes.append(log.max((0, 1)).min() == 0)
        steps.append(np.abs(np.diff(log, axis=0)).max() / log.max())
    dyes, steps = np.array(dyes), np.array(steps)
    assert 0 < dyes.sum() < 40 and np.median(steps[dyes]) > 1.5 * np.median(steps[~dyes])
