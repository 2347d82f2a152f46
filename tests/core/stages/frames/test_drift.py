# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exposure and white balance: what a camera changed is found and evened out; what the light does to a turning head is
not taken for it."""

import cv2
import numpy as np
import pytest
from skimage.data import astronaut

from core.face import faces
from core.imaging import images
from core.stages.frames import drift
from core.stages.frames.drift import content_of, gains_of

HEIGHT, WIDTH = 300, 400


def exposed(linear: np.ndarray, gain=1.0) -> np.ndarray:
    """A linear picture as a camera of that gain stores it: sRGB of 8 bits."""
    return (np.round(images.linear_to_srgb(linear * np.asarray(gain, np.float32)) * 255) / 255).astype(np.float32)


def walk(count: int) -> list[np.ndarray]:
    """Linear pictures of a camera that moves before a person and what is behind her."""
    whole = images.srgb_to_linear(astronaut().astype(np.float32) / 255) * 0.7
    return [whole[i : i + 360, 2 * i : 2 * i + 400] for i in range(count)]


def errors(gains: np.ndarray, true: np.ndarray) -> np.ndarray:
    """|log| of what is left of the true exposure, against the median frame."""
    left = np.log(gains * true)
    return np.abs(left - np.median(left, 0))


def test_known_gains_are_recovered():
    k = np.arange(20)
    level = np.exp(0.3 * np.sin(k / 4) + 0.15 * (k > 11))
    true = np.stack([level, level * np.exp(0.05 * np.sin(k / 9)), level * np.exp(-0.12 * k / 20)], 1)
    gains = gains_of([content_of(exposed(picture, gain)) for picture, gain in zip(walk(20), true, strict=True)])
    assert np.ptp(np.log(true[:, 2])) > 0.5
    assert np.percentile(errors(gains, true), 95) < 0.02 and errors(gains, true).max() < 0.04
    assert np.median(gains, 0) == pytest.approx(1, abs=0.02)


def test_a_steady_exposure_is_left_alone():
    for pictures in (walk(8), [np.full((60, 80, 3), 0.5, np.float32)] * 3):
        assert (gains_of([content_of(exposed(picture)) for picture in pictures]) == 1).all()


def noise(rng, cells: int, width: int, height: int) -> np.ndarray:
    lattice = rng.normal(size=(height // cells, width // cells, 1)).astype(np.float32)
    return np.exp(0.5 * cv2.resize(lattice, (width, height), interpolation=cv2.INTER_CUBIC))


def turning_head(angle: float, skin: np.ndarray, wall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A painted ball before a wall, lit from the left and above and turned by `angle` (radians) with its light held
    still: linear picture, its mask."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    right, up = (x - WIDTH / 2) / 130, (HEIGHT / 2 - y) / 130
    inside = right**2 + up**2 < 1
    near = np.sqrt(np.maximum(1 - right**2 - up**2, 0))
    light = np.array([-0.75, 0.3, 0.6]) / np.linalg.norm([-0.75, 0.3, 0.6])
    shade = 0.12 + 0.88 * np.maximum(right * light[0] + up * light[1] + near * light[2], 0)
    u = ((np.arctan2(right, near) + angle + np.pi) / (2 * np.pi) * skin.shape[1]).astype(np.float32)
    v = (np.arccos(np.clip(up, -1, 1)) / np.pi * skin.shape[0]).astype(np.float32)
    albedo = cv2.remap(skin, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    head = (albedo * shade)[..., None] * np.array([0.5, 0.36, 0.28])
    return np.where(inside[..., None], head, wall[..., None] * 0.3).astype(np.float32), inside


def turn(monkeypatch, skin: np.ndarray, wall: np.ndarray, gains: np.ndarray) -> list[drift.Content]:
    """A head that turns before a wall, by a camera of these gains."""
    contents = []
    for i, gain in enumerate(gains):
        picture, inside = turning_head(0.0675 * i, skin, wall)
        mask = inside.astype(np.float32)
        monkeypatch.setattr(faces, "segment_person", lambda small, mask=mask: cv2.resize(mask, small.shape[1::-1]))
        contents.append(content_of(exposed(picture, gain)))
    return contents


@pytest.mark.parametrize("textured", [True, False], ids=["a textured wall", "an empty wall"])
@pytest.mark.parametrize("drifting", [False, True], ids=["steady", "drifting"])
def test_a_head_that_turns_into_the_shade_is_not_drift(monkeypatch, textured, drifting):
    rng, count = np.random.default_rng(3), 12
    skin = noise(rng, 8, 1200, 480)
    wall = noise(rng, 9, WIDTH, HEIGHT) if textured else np.ones((HEIGHT, WIDTH), np.float32)
    true = np.exp(drifting * 0.25 * np.sin(np.arange(count) / 4))[:, None] * np.ones(3)
    contents = turn(monkeypatch, skin, wall, true)
    assert np.mean([c.person.mean() for c in contents]) > (0.2 if textured else 0.8)
    gains = gains_of(contents)
    if not drifting:
        assert (gains == 1).all()
    elif textured:
        assert errors(gains, true).max() < 0.03
    else:
        # turn and exposure cannot be told apart in one shaded ball: it may leave the drift in, but must not add to it
        assert errors(gains, true).max() < errors(np.ones((count, 3)), true).max() + 0.05


@pytest.mark.parametrize(("wall", "left"), [(1.0, 0.5), (0.0, 0.7)], ids=["an empty wall", "a black ground"])
def test_a_jump_is_evened_in_part_while_the_head_turns_before_nothing(monkeypatch, wall, left):
    skin = noise(np.random.default_rng(3), 8, 1200, 480)
    true = np.where(np.arange(8) < 5, 1.0, 0.7)[:, None] * np.ones(3)
    gains = gains_of(turn(monkeypatch, skin, np.full((HEIGHT, WIDTH), wall, np.float32), true))
    assert errors(gains, true).max() < left * abs(np.log(0.7))


def test_a_change_counts_as_far_as_person_and_ground_agree():
    def agreed(person: float, ground: float | None, deviation: float = 0.1) -> float:
        behind = None if ground is None else drift.Link(np.full(3, ground), 0.01)
        return drift._agreed(drift.Link(np.full(3, person), deviation), behind).gain.mean()

    assert agreed(-0.3, -0.2) == agreed(-0.2, -0.3) == pytest.approx(-0.2)
    assert agreed(-0.3, 0.2) == agreed(-0.3, 0) == 0, "one of them denies it"
    assert agreed(-0.15, None) == 0 and agreed(-0.25, None) == pytest.approx(-0.25)


def test_matches_that_move_by_themselves_are_left_out():
    rng = np.random.default_rng(0)
    place = rng.uniform(0, 400, (100, 2))
    moved = place * 1.05 + [20, 5]
    moved[:30] = rng.uniform(0, 400, (30, 2))
    kept = drift._moving_together(place, moved)
    assert kept[30:].mean() > 0.8 and kept[:30].mean() < 0.1
    assert not drift._moving_together(place, rng.uniform(0, 400, (100, 2))).any()


def test_metadata_stand_in_for_surface_points_if_every_picture_has_them():
    flat = [np.full((60, 80, 3), level, np.float32) for level in (0.5, 0.4, 0.5)]
    stated = [content_of(picture, exposure) for picture, exposure in zip(flat, (0.0, -0.4, 0.0), strict=True)]
    assert np.log(gains_of(stated)).mean(1) == pytest.approx([0, 0.4, 0], abs=0.01)
    stated[2] = content_of(flat[2])
    assert (gains_of(stated) == 1).all()


@pytest.mark.parametrize(("scatter", "told"), [(0.03, True), (0.5, False)])
def test_a_change_that_a_few_spots_disagree_about_is_none(scatter, told):
    """Twenty spots of the ground in four cells, darker by 0.3 in the median: of one surface, or taken for it."""
    rng = np.random.default_rng(2)
    descriptors = rng.integers(0, 256, (20, 128), np.uint8)
    place = np.float32([[x, y] for x in (5, 45) for y in (5, 45)] * 5) + rng.uniform(0, 20, (20, 2)).astype(np.float32)
    first = rng.normal(-1.5, 0.3, (20, 3)).astype(np.float32)
    change = np.sort(rng.normal(0, scatter, (20, 3)), axis=0)
    second = first - 0.3 + (change - np.median(change, axis=0)).astype(np.float32)
    ground, behind = np.zeros(20, bool), np.full((10, 10, 3), np.nan, np.float32)
    pair = [drift.Content(descriptors, colours, place, ground, behind) for colours in (first, second)]
    gains = np.log(gains_of(pair))
    assert (np.ptp(gains, axis=0) == pytest.approx(0.3, abs=0.01)) if told else not gains.any()
