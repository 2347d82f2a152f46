# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole head: a painted head known everywhere loses all but its face, and is completed; nothing seen changes, no seam
shows."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.face import template
from core.stages.solve.capture_evidence import BEARD_TRUST, FULL_CONFIDENCE
from core.stages.solve.confidence import estimate_confidence
from core.stages.upscale import grain
from core.stages.upscale.maps import HeadMaps
from core.stages.upscale.whole_head import complete, seen_well
from tests.fixtures.hairy_head import SIZE, beard_zone, painted, surface
from tests.fixtures.painted_skin import plain_evidence

WRONG = np.float32([1.4, 1.0, 0.8])
"""What the unseen part is off by: another tone, as the solver's mean face has it."""


@pytest.fixture(scope="module")
def truth() -> HeadMaps:
    return painted()


@pytest.fixture(scope="module")
def cut(truth) -> HeadMaps:
    """The same where only the face was seen: elsewhere one plain tone, flat and dull."""
    seen = template.mask("face", SIZE)
    hidden = seen < 0.5
    plain = truth.diffuse[template.mask("skin", SIZE) > 0.99].mean(0) * WRONG
    return replace(
        truth,
        confidence=0.7 * seen,
        seen=seen,
        diffuse=np.where(hidden[..., None], plain, truth.diffuse).astype(np.float32),
        normal=np.where(hidden[..., None], np.float32([0, 0, 1]), truth.normal),
        specular=np.where(hidden, np.float32(0.2), truth.specular),
    )


def completed(maps: HeadMaps) -> HeadMaps:
    return complete(maps, surface(), Reporter("upscale"))


@pytest.fixture(scope="module")
def done(cut) -> HeadMaps:
    return completed(cut)


def spread(values: np.ndarray) -> float:
    """Half the width of the middle two thirds: what wrinkles add to the face's deviation is no grain."""
    return float(np.subtract(*np.percentile(values, [83, 17]))) / 2


def hidden() -> np.ndarray:
    return template.mask("face", SIZE) < 0.02


def test_what_was_seen_well_keeps_its_bytes(cut, done):
    seen = seen_well(cut.seen, surface()) >= 1
    assert 0.3 < seen.mean() < 0.65
    for name in ("diffuse", "normal", "specular"):
        assert getattr(done, name)[seen].tobytes() == getattr(cut, name)[seen].tobytes()
    assert np.array_equal(done.confidence, cut.confidence) and np.array_equal(done.shading, cut.shading)


def test_the_hidden_skin_comes_nearer_to_its_tone(truth, cut, done):
    """Log albedo, means over the head's hidden texels; the plain tone is off by WRONG."""
    off = [np.abs(np.log(maps.diffuse[hidden()]) - np.log(truth.diffuse[hidden()])).mean() for maps in (cut, done)]
    assert off[1] < 0.6 * off[0]
    dull = [abs(float((maps.specular - truth.specular)[hidden()].mean())) for maps in (cut, done)]
    assert dull[1] < 0.5 * dull[0]


def test_pores_go_on_with_the_strength_they_have_on_the_face(truth, done):
    """A fine band's spread of log albedo, and the normals' tilt, on the hidden neck beside the seen face, within a
    factor of 1.6."""
    neck = hidden() & (template.mask("neck", SIZE) > 0.9) & (surface().texel < 1.5 * np.median(surface().texel))
    face = template.mask("skin", SIZE) > 0.99
    assert neck.sum() > 300
    every = np.ones((SIZE, SIZE), np.float32)
    light = np.log(done.diffuse)
    fine = grain.bands(light, every, float(np.median(surface().texel)))[2]
    assert 1 / 1.6 < spread(fine[neck]) / spread(fine[face]) < 1.6
    tilt = done.normal[..., :2]
    assert 1 / 1.6 < spread(tilt[neck]) / spread(tilt[face]) < 1.6
    assert np.abs(np.linalg.norm(done.normal, axis=2) - 1).max() < 1e-5


def test_the_border_of_the_seen_part_is_no_step(cut, done):
    """Means on both sides of the border, 6 mm apart, differ by no more than those of bands as far apart within the
    skin; before, by far more."""
    signed = template.mask("face", SIZE)
    soft = grain.blurred(signed[..., None], np.ones_like(signed), 12.0)[..., 0]
    deep, inner, outer = ((soft > low) & (soft < low + 0.15) for low in (0.75, 0.60, 0.25))

    def step(maps: HeadMaps, one, other) -> float:
        return float(np.abs(np.log(maps.diffuse[one]).mean(0) - np.log(maps.diffuse[other]).mean(0)).max())

    assert step(done, inner, outer) < step(done, deep, inner) + 0.05
    assert step(done, inner, outer) < 0.5 * step(cut, inner, outer)


def test_no_uv_seam_shows(done):
    """Texels on both edges of the map's cut that lie within a millimetre and a half of each other differ no more than
    neighbours do."""
    edge = np.zeros((SIZE, SIZE), bool)
    edge[[0, -1]] = edge[:, [0, -1]] = True
    at, place = np.argwhere(edge & hidden()), surface().position[edge & hidden()]
    far = np.abs(at[:, None] - at[None]).max(2) > 20
    near = np.linalg.norm(place[:, None] - place[None], axis=2) < 1.5
    first, second = np.nonzero(near & far)
    assert len(first) > 50
    light = np.log(done.diffuse).mean(2)
    across = np.abs(light[tuple(at[first].T)] - light[tuple(at[second].T)]).mean()
    coarse = surface().texel[:, 1:] > 2 * np.median(surface().texel)
    beside = np.abs(np.diff(light, axis=1))[hidden()[:, 1:] & coarse].mean()
    assert across < 1.5 * beside + 0.01


def test_seen_hair_is_carried_on_over_the_scalp(cut):
    """The front half of the scalp was seen, and is dark: so is the back then, and the nape is not."""
    scalp = template.mask("scalp", SIZE) > 0.5
    front = scalp & (surface().position[..., 1] < np.median(surface().position[scalp][:, 1]))
    diffuse, confidence, seen = cut.diffuse.copy(), cut.confidence.copy(), cut.seen.copy()
    diffuse[front], confidence[front], seen[front] = 0.05, 0.7, 1
    done = completed(replace(cut, diffuse=diffuse, confidence=confidence, seen=seen))
    back = scalp & ~front & (surface().position[..., 1] > np.percentile(surface().position[scalp][:, 1], 75))
    neck = (template.mask("neck", SIZE) > 0.9) & hidden()
    assert np.median(done.diffuse[back]) < 0.08 and np.median(done.diffuse[neck]) > 0.15


def test_a_patch_of_scalp_among_unseen_is_no_stain_and_a_scalp_seen_all_around_keeps_its_bytes(cut):
    """Two patches of scalp, of 8 and of 45 mm, seen like the face and half as bright as what is around them."""
    position, scalp = surface().position, template.mask("scalp", SIZE) > 0.9
    crown = position[scalp][position[scalp][:, 2].argmax()]
    distance, given, done = np.linalg.norm(position - crown, axis=2), [], []
    for radius_mm in (8, 45):
        patch = (distance < radius_mm) & scalp
        confidence, seen = (np.where(patch, np.float32(x), y) for x, y in ((0.7, cut.confidence), (1, cut.seen)))
        diffuse = np.where(patch[..., None], 0.5 * cut.diffuse, cut.diffuse)
        given.append(replace(cut, confidence=confidence, seen=seen, diffuse=diffuse))
        done.append(completed(given[-1]))

    def contrast(maps: HeadMaps) -> float:
        light = np.log(maps.diffuse).mean(2)
        return float(light[(distance < 4) & scalp].mean() - light[(distance > 15) & (distance < 25) & scalp].mean())

    assert contrast(given[0]) < -0.5 and abs(contrast(done[0])) < 0.1
    inner = (distance < 8) & scalp
    assert np.array_equal(done[1].diffuse[inner], given[1].diffuse[inner])


def test_a_stray_patch_that_was_seen_at_a_glance_goes_and_a_mark_that_was_seen_well_stays(truth, cut):
    """Two patches of the neck seen half as well as the face, one of them three times as bright as its skin; and a mark
    on the cheek as dark."""

    def near(at, radius_mm: float) -> np.ndarray:
        return np.linalg.norm(position - position[tuple(at)], axis=2) < radius_mm

    position, texel = surface().position, surface().texel
    below = np.argwhere((template.mask("neck", SIZE) > 0.9) & (texel < 1.5 * np.median(texel)))
    below = below[np.argsort(position[tuple(below.T)][:, 0])]
    sides = below[len(below) // 5], below[4 * len(below) // 5]
    stray, plain = (near(at, 14) for at in sides)
    well = (template.mask("face", SIZE) > 0.99) & (seen_well(cut.seen, surface()) >= 1)
    mark = near(np.argwhere(well & (template.mask("skin", SIZE) > 0.99))[5000], 3) & well
    halves = ((0.35, cut.confidence), (0.5, cut.seen))
    confidence, seen = (np.where(stray | plain, np.float32(half), each) for half, each in halves)
    diffuse = np.where((stray | plain)[..., None], truth.diffuse, cut.diffuse)
    diffuse[stray], diffuse[mark] = np.minimum(3 * diffuse[stray], 1), diffuse[mark] / 3
    told = completed(replace(cut, confidence=confidence, seen=seen, diffuse=diffuse.astype(np.float32)))
    off = [float(np.abs(np.log(told.diffuse[near(at, 4)] / truth.diffuse[near(at, 4)])).mean()) for at in sides]
    assert off[0] < 0.3 and off[1] < 0.2, off  # the stray one was off by 1.1
    assert np.array_equal(told.diffuse[mark], diffuse[mark].astype(np.float32)) and mark.sum() > 5


def test_a_beard_that_was_seen_well_keeps_its_bytes(cut, done):
    """With the confidence that the solver itself gives a beard."""
    jaw = beard_zone()
    diffuse = (cut.diffuse * (1 - 0.88 * jaw[..., None])).astype(np.float32)
    evidence = plain_evidence(
        SIZE,
        weight=torch.from_numpy(np.clip(cut.seen / FULL_CONFIDENCE, 0, 1)),
        trust=torch.from_numpy((1 - (1 - BEARD_TRUST) * jaw).astype(np.float32)),
    )
    confidence = estimate_confidence(evidence, diffuse)
    bearded = (jaw > 0.99) & (seen_well(cut.seen, surface()) >= 1)
    assert bearded.sum() > 100 and np.median(confidence[bearded]) < 0.7
    told = completed(replace(cut, diffuse=diffuse, confidence=confidence))
    assert np.array_equal(told.diffuse[bearded], diffuse[bearded])
    plain = hidden() & (template.mask("neck", SIZE) > 0.9)
    assert np.log(told.diffuse[plain]).std() < 1.3 * np.log(done.diffuse[plain]).std(), "no grain of hair on the neck"


def test_a_head_seen_all_over_or_not_at_all_stays_as_it_is(truth):
    assert completed(truth) is truth
    blind = replace(truth, confidence=np.zeros_like(truth.confidence), seen=np.zeros_like(truth.seen))
    assert np.isfinite(completed(blind).diffuse).all()
