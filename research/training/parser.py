# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the face parser on photographs of synthetic people, whose parts are known.

    python -m research.training parser --config cpu|gpu [--hdri FOLDER]

FOLDER: panoramas (.hdr, .exr) that may light photographs; without them all light is procedural.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.face.parser_network import network_input
from core.face.parts import PARTS, SIDE_PX, cut, inside, to_crop

from ..people.lifelike import unlit
from ..people.lifelike.figure import make_figure
from ..people.lifelike.snapshot import photograph
from .readers import TEXELS, Focus, Jitter, Reader, degrade, jitter_crop
from .sights import SightStore

_MODEL = {"widths": [40, 64, 112, 144], "depths": [1, 1, 1, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": dict(batch=8, echo=3, rate=8e-4, minutes=60, figures=360, views=10, held_out=6, seed=0, workers=1),
    },
    "gpu": {
        "model": _MODEL,
        "training": dict(
            batch=32, echo=1, rate=2e-3, minutes=30, figures=720, views=10, held_out=6, seed=0, workers=14
        ),
    },
}
"""A step shows `batch` crops; every `echo` steps show the same photographs."""
SMALL = Focus([PARTS.index(name) for name in ("lips", "brows", "eyes", "beard")], 3.0, 7)
JITTER = Jitter(0.04, 0.09, 6.0)


def make_sights(store: SightStore, seed: int) -> None:
    """Trace the sights of one figure: some ten seconds, and one per view."""
    scene = unlit.scene_of(make_figure(seed, TEXELS), np.random.default_rng([seed, 90]))
    store.path(seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for view in range(store.count):
        rng = np.random.default_rng([seed, 91, view])
        unlit.save(store.path(seed, view), unlit.trace_unlit(scene, unlit.random_view(scene.figure, rng), rng))


def shoot(
    path: Path, rng: np.random.Generator, panoramas: list[np.ndarray], echo: int = 1, augment: bool = True
) -> Iterator[tuple[np.ndarray, ...]]:
    """Take a photograph of a sight, and crop it `echo` times."""
    sight = unlit.load(path)
    srgb, shares = photograph(sight, rng, panoramas)
    for _ in range(echo):
        yield make_example(srgb, shares, sight.landmarks, rng, augment)


def make_example(
    srgb: np.ndarray, shares: np.ndarray, landmarks: np.ndarray, rng: np.random.Generator, augment: bool = True
) -> tuple[np.ndarray, ...]:
    """Return the arrays of a LabelBatch for one crop.

    srgb: [H, W, 3]; shares: [H, W, len(PARTS)] in [0, 1]; landmarks: [468, 2] in pixels.
    """
    if augment and rng.random() < 0.5:
        srgb, shares = srgb[:, ::-1], shares[:, ::-1]
        landmarks = landmarks * [-1, 1] + [srgb.shape[1], 0]
    move = to_crop(landmarks)  # of the bridge, the chin and the box, which a mirror leaves what they are
    if augment:
        move = jitter_crop(move, SIDE_PX, JITTER, rng)
    known = inside(srgb.shape, move)
    if augment and rng.random() < 0.35:
        known = known * _end_picture(rng)
    picture, parts = cut(srgb, move), cut(shares, move)
    if augment:
        picture = degrade(picture, rng)
    total = parts.sum(-1, keepdims=True)
    known = known * (total[..., 0] > 0.99)
    parts = parts / np.maximum(total, 1e-3)
    return network_input(picture, known), np.ascontiguousarray(parts.transpose(2, 0, 1)), known[None].astype(np.float32)


def _end_picture(rng: np.random.Generator) -> np.ndarray:
    """Draw the extent of a picture that ends within the crop [SIDE, SIDE], as that of a close face does."""
    known = np.ones((SIDE_PX, SIDE_PX), np.float32)
    for turn in range(4):
        if rng.random() < 0.4:
            np.rot90(known, turn)[: int(rng.uniform(0, 0.25) * SIDE_PX)] = 0
    return known


READER = Reader(
    "parser",
    CONFIGS,
    lambda options: options["views"],
    make_sights,
    shoot,
    classes=len(PARTS),
    focus=SMALL,
    crops=8,
    groups={name: [k] for k, name in enumerate(PARTS)},
    subject="synthetic people",
    measured="photographs of held-out figures: intersection over union of each part, "
    "where a part is what most of a pixel is",
)
TRAINING = READER.training()
