# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the eye reader on photographs of synthetic people's eyes, whose whites and irises are known.

    python -m research.training eyes --config cpu|gpu [--hdri FOLDER]

As `parser`; figures mostly without hair, which takes most of a figure's time and seldom hangs over an eye.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.face.eye_reader import CLASSES, SIDE_PX, to_eye_crop
from core.face.parser_network import network_input
from core.face.parts import cut, inside

from ..people.lifelike import eye_sights, unlit
from ..people.lifelike.figure import make_figure
from ..people.lifelike.person import sample_person
from .readers import TEXELS, Focus, Jitter, Reader, degrade, jitter_crop
from .sights import SightStore

_MODEL = {"widths": [32, 48, 64, 96], "depths": [1, 1, 1, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": dict(
            batch=16, echo=3, rate=1.5e-3, minutes=40, figures=160, poses=3, held_out=6, seed=0, workers=1
        ),
    },
    "gpu": {
        "model": _MODEL,
        "training": dict(batch=64, echo=1, rate=3e-3, minutes=20, figures=640, poses=3, held_out=6, seed=0, workers=14),
    },
}
VIEWS = 4
"""Sights of each pose of a figure's lids, half of them of the left eye."""
HAIRY = 0.25
"""Share of the figures that keep their hair."""
BALL = Focus([1, 2], 4.0, 5)  # most of a crop is skin
JITTER = Jitter(0.07, 0.13, 7.0)


def make_sights(store: SightStore, seed: int) -> None:
    """Trace the sights of one figure's eyes."""
    rng = np.random.default_rng([seed, 95])
    person = sample_person(seed)
    figure = make_figure(person if rng.random() < HAIRY else replace(person, hair="none", beard="none"), TEXELS)
    store.path(seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for number in range(store.count):
        if number % VIEWS == 0:
            scene = unlit.scene_of(eye_sights.with_other_lids(figure, rng), rng)
        eye_sights.save(store.path(seed, number), eye_sights.see_eye(scene, number % 2 == 1, rng))


def shoot(
    path: Path, rng: np.random.Generator, panoramas: list[np.ndarray], echo: int = 1, augment: bool = True
) -> Iterator[tuple[np.ndarray, ...]]:
    """Take a photograph of a sight, and crop it `echo` times."""
    sight = eye_sights.load(path)
    picture, ball = eye_sights.photograph_eye(sight, rng, panoramas)
    for _ in range(echo):
        yield make_example(picture, ball, sight, rng, augment)


def make_example(
    picture: np.ndarray, ball: np.ndarray, sight: eye_sights.EyeSight, rng: np.random.Generator, augment: bool = True
) -> tuple[np.ndarray, ...]:
    """Return the arrays of a LabelBatch for one crop.

    picture: sRGB [S, S, 3]; ball: [S, S, 2] in [0, 1], shares of white and iris.
    """
    move = to_eye_crop(sight.corners, sight.left)
    if augment:
        move = jitter_crop(move, SIDE_PX, JITTER, rng)
    crop = cut(picture, move, SIDE_PX)
    if augment:
        crop = degrade(crop, rng)
    shares = np.clip(cut(ball, move, SIDE_PX), 0, 1)
    shares = np.concatenate([1 - shares.sum(-1, keepdims=True), shares], -1)
    layers = network_input(crop, inside(picture.shape, move, SIDE_PX))
    return layers, np.ascontiguousarray(np.clip(shares, 0, 1).transpose(2, 0, 1), np.float32), layers[-1:]


READER = Reader(
    "eyes",
    CONFIGS,
    lambda options: options["poses"] * VIEWS,
    make_sights,
    shoot,
    classes=len(CLASSES),
    focus=BALL,
    crops=32,
    groups={"ball": [1, 2], "iris": [2]},
    subject="synthetic people's eyes",
    measured="photographs of held-out figures' eyes: intersection over union of the ball and of the iris, "
    "where a class is what most of a pixel is",
)
TRAINING = READER.training()
