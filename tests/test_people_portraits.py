# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The people that a delighter learns from: their light must know nothing of what grows on them or of what colour they
are."""

from dataclasses import fields, replace

import numpy as np
import pytest

from core.contract.messages import Reporter
from core.face.parts import PARTS
from core.imaging import images
from core.synthetic.people import portraits, relightable
from core.synthetic.people.figure import make_figure
from core.training import people

QUIET = Reporter("train", emit=lambda message: None)
BEARDED = 1010


@pytest.fixture(scope="module")
def stage():
    sitter = relightable.Sitter(make_figure(BEARDED, 256), np.random.default_rng(0))
    return next(s for s in (sitter.stage(np.random.default_rng(seed)) for seed in range(9))
                if share(s, "beard").sum() > 150 and share(s, "brows").sum() > 100)


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
    assert all(np.array_equal(getattr(stage, f.name), getattr(back, f.name))
               for f in fields(relightable.RelightableView) if f.name != "unlit")
    assert all(np.array_equal(getattr(stage.unlit, f.name), getattr(back.unlit, f.name))
               for f in fields(relightable.Unlit))


def test_light_does_not_know_the_pigment(stage):
    """Two people of the same shape under the same light, one with a black beard and brows and a blotch: their light is
    the same, exposure apart."""
    shares = stage.unlit.shares.astype(np.float32) / 255
    shares /= np.maximum(shares.sum(-1, keepdims=True), 1e-6)
    plain = portraits.Colours(np.full((*stage.here.shape, 3), 0.4, np.float32), shares)
    dark = plain.albedo * np.exp(-2 * (share(stage, "beard") + share(stage, "brows")))[..., None]
    dark[100:130, 100:130] *= np.float32([0.6, 0.4, 0.4])
    made = [portraits.portray(stage, portraits.Colours(albedo, shares), np.random.default_rng(4))
            for albedo in (plain.albedo, dark)]
    pictures = [images.srgb_to_linear(portrait.srgb) for portrait in made]
    assert contrast(pictures[1], stage) - contrast(pictures[0], stage) > 0.8
    known = (made[0].skin > 0.99) & (made[1].skin > 0.99) & (made[0].even.min(-1) > 0.02)
    apart = np.log(made[1].even[known]) - np.log(made[0].even[known])
    lit = np.log(made[0].even[known])
    assert known.sum() > 2000 and lit.std() > 0.15 and (apart - np.median(apart, 0)).std() < 0.1 * lit.std()


def test_brows_and_beard_are_lit_as_the_bare_head_is(stage):
    colours = portraits.colours_of(stage, np.random.default_rng(1))
    for seed in range(6):
        made = portraits.portray(stage, colours, np.random.default_rng(seed))
        grown = (share(stage, "brows") + share(stage, "beard") > 0.9) & stage.here & (made.head > 0.99)
        slopes = np.abs(np.diff(np.log(np.maximum(made.even.mean(-1), 0.02)), axis=1))[:, :-1][grown[:, 1:-1]]
        strands = np.abs(np.diff(np.log(np.maximum(made.shading.mean(-1), 0.02)), axis=1))[:, :-1][grown[:, 1:-1]]
        assert np.median(slopes) < 0.5 * np.median(strands)  # no strand is seen in it


def test_a_lamp_that_is_blocked_everywhere_lights_nothing(stage):
    dark = replace(stage, unlit=replace(stage.unlit, reach=0 * stage.unlit.reach), reach=0 * stage.reach)
    colours = portraits.colours_of(stage, np.random.default_rng(2))
    for seed in range(20):
        made = portraits.portray(dark, colours, np.random.default_rng(seed))
        if made.strong > 0.4:
            assert made.shadow[stage.here].min() > 0.999
            return
    pytest.fail("no light was strong in twenty draws")


def test_batches_show_each_sight_under_two_lights_and_depend_on_the_seed_alone(tmp_path):
    people.prepare_people([BEARDED], 1, tmp_path, QUIET, processes=1)
    drawn = [people.People([BEARDED, BEARDED + 1], 1, tmp_path, None).draw(1, np.random.default_rng(3))
             for _ in range(2)]
    assert all(np.array_equal(getattr(drawn[0], f.name), getattr(drawn[1], f.name)) for f in fields(drawn[0]))
    batch = drawn[0]
    assert batch.layers.shape[0] == 2 and not np.allclose(batch.shading[0], batch.shading[1], atol=0.1)
    log = batch.layers[:, 3:6].unfold(2, 2, 2).unfold(3, 2, 2).mean((-1, -2))
    albedo = log - batch.shading
    both = (batch.weight[0] * batch.weight[1])[0] > 0.9
    left = (albedo[0] - albedo[1])[:, both]
    light = (batch.shading[0] - batch.shading[1])[:, both]
    assert (left - left.mean(1, keepdim=True)).abs().mean() < 0.6 * (light - light.mean(1, keepdim=True)).abs().mean()
