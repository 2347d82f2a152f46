# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures a parser learns from: figures seen from many sides, lit, recoloured, covered and photographed anew for
every step.

What light does not change is made once per figure and kept in a work folder (some ten seconds and one per view).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import Dataset

from core.capture.messages import Problem, Reporter
from core.face.parser_network import network_input
from core.face.parts import SIDE_PX, cut, inside, to_crop

from ..people.environments import read_panoramas
from ..people.lifelike import unlit
from ..people.lifelike.figure import make_figure
from ..people.lifelike.snapshot import photograph
from . import descent
from .release import TrainingCard, again, release

TEXELS = 512  # of a figure's maps: pixels of a crop are larger than theirs


@dataclass(frozen=True)
class Jitter:
    """Deviations of where the landmarks put a crop: shift in crops, scale as a logarithm, turn in degrees."""

    shift: float
    scale: float
    turn_deg: float


JITTER = Jitter(0.04, 0.09, 6.0)


@dataclass(frozen=True)
class SnapshotBatch:
    """layers [N, CHANNELS, SIDE, SIDE]; shares [N, len(PARTS), SIDE, SIDE] add up to one wherever known [N, 1, SIDE,
    SIDE] is 1."""

    layers: torch.Tensor
    shares: torch.Tensor
    known: torch.Tensor


def prepare(seeds: list[int], views: int, work: Path, report: Reporter) -> None:
    """Makes the sights of these figures that the work folder lacks.

    Parameters
    ----------
    seeds : the figures
    views : sights of each
    work : folder in which they are kept
    report : hears of progress
    """
    missing = [seed for seed in seeds if not is_prepared(seed, views, work)]
    for i, seed in enumerate(missing):
        report.progress(i, len(missing), f"figure {i + 1} of {len(missing)}")
        _prepare_one(seed, views, work)


def is_prepared(seed: int, views: int, work: Path) -> bool:
    return _path(work, seed, views - 1).is_file()  # the last one is written last


class Snapshots:
    """Draws batches of the figures that are prepared; what is prepared later is drawn from then on."""

    def __init__(self, seeds: list[int], views: int, work: Path, panoramas: Path | None):
        self.seeds, self.views, self.work = seeds, views, work
        self.panoramas = read_panoramas(panoramas)

    def draw(self, count: int, echo: int, rng: np.random.Generator, augment: bool = True) -> list[SnapshotBatch]:
        """Batches of the same photographs, cropped and spoilt in other ways.

        Parameters
        ----------
        count : crops of each batch
        echo : number of batches
        rng : of all of it
        augment : off: cropped as the landmarks say, neither mirrored nor spoilt
        """
        ready = [seed for seed in self.seeds if is_prepared(seed, self.views, self.work)]
        batches: list[list[tuple]] = [[] for _ in range(echo)]
        for _ in range(count):
            sight = unlit.load(_path(self.work, ready[rng.integers(len(ready))], int(rng.integers(self.views))))
            srgb, shares = photograph(sight, rng, self.panoramas)
            for batch in batches:
                batch.append(make_example(srgb, shares, sight.landmarks, rng, augment))
        return [
            SnapshotBatch(*(torch.from_numpy(np.stack(arrays)) for arrays in zip(*batch, strict=True)))
            for batch in batches
        ]


class Echoed(Dataset):
    """The batch of each step: it depends on the step alone once all figures are prepared, so a resumed training draws
    what an unbroken one would have. Every options["echo"] steps show the same photographs; source.draw(count, echo,
    rng) gives their batches."""

    def __init__(self, source, options: dict):
        self.source, self.options = source, options
        self.drawn: tuple[int, list] = -1, []

    def __getitem__(self, step: int):
        torch.set_num_threads(1)
        index, turn = divmod(step, self.options["echo"])
        if self.drawn[0] != index:
            self.drawn = (
                index,
                self.source.draw(
                    self.options["batch"], self.options["echo"], np.random.default_rng((self.options["seed"], index))
                ),
            )
        return self.drawn[1][turn]


def make_example(
    srgb: np.ndarray, shares: np.ndarray, landmarks: np.ndarray, rng: np.random.Generator, augment: bool = True
) -> tuple[np.ndarray, ...]:
    """A photograph as the network sees it.

    Parameters
    ----------
    srgb : [H, W, 3]
    shares : [H, W, len(PARTS)] in [0, 1], of its parts
    landmarks : [468, 2], in pixels
    rng : of the crop and the spoiling
    augment : whether there are any, and mirror images

    Returns
    -------
    Layers float32 [CHANNELS, SIDE_PX, SIDE_PX], shares [len(PARTS), SIDE_PX, SIDE_PX], and 1 where these are known [1,
    SIDE_PX, SIDE_PX].
    """
    if augment and rng.random() < 0.5:
        srgb, shares = srgb[:, ::-1], shares[:, ::-1]
        landmarks = landmarks * [-1, 1] + [srgb.shape[1], 0]
    move = to_crop(landmarks)  # of the bridge, the chin and the box, which a mirror leaves what they are
    if augment:
        move = jitter_crop(move, SIDE_PX, JITTER, rng)
    known = inside(srgb.shape, move)
    if augment and rng.random() < 0.35:
        known = known * _ended(rng)
    picture, parts = cut(srgb, move), cut(shares, move)
    if augment:
        picture = spoilt(picture, rng)
    total = parts.sum(-1, keepdims=True)
    known = known * (total[..., 0] > 0.99)
    parts = parts / np.maximum(total, 1e-3)
    return network_input(picture, known), np.ascontiguousarray(parts.transpose(2, 0, 1)), known[None].astype(np.float32)


def jitter_crop(move: np.ndarray, side: int, spread: Jitter, rng: np.random.Generator) -> np.ndarray:
    """A map to a crop as if the landmarks that it goes by lay a little elsewhere.

    Parameters
    ----------
    move : [2, 3], from picture to crop, in pixels
    side : of the crop, in pixels
    spread : how far elsewhere
    rng : of the shift, the scale and the turn

    Returns
    -------
    [2, 3], as `move` is.
    """
    turn, scale = np.radians(rng.normal(0, spread.turn_deg)), np.exp(rng.normal(0, spread.scale))
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    about = np.array([[c, s], [-s, c]])
    middle = np.full(2, side / 2)
    shift = middle - about @ middle + rng.normal(0, spread.shift * side, 2)
    return np.concatenate([about @ move[:, :2], (about @ move[:, 2] + shift)[:, None]], 1)


def _ended(rng: np.random.Generator) -> np.ndarray:
    """A picture that ends within the crop [SIDE, SIDE], as that of a close face does."""
    known = np.ones((SIDE_PX, SIDE_PX), np.float32)
    for turn in range(4):
        if rng.random() < 0.4:
            known = np.rot90(known, turn).copy()
            known[: int(rng.uniform(0, 0.25) * SIDE_PX)] = 0
            known = np.rot90(known, -turn).copy()
    return known


def spoilt(picture: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A square crop [S, S, 3] with another white balance and gamma, less resolution, no colour, now and then."""
    side = len(picture)
    if rng.random() < 0.6:
        picture = np.clip(picture, 0, 1) ** np.float32(np.exp(rng.normal(0, 0.2))) * np.exp(
            rng.normal(0, 0.1, 3) + rng.normal(0, 0.15)
        ).astype(np.float32)
    if rng.random() < 0.35:
        small = int(side / np.exp(rng.uniform(np.log(1.2), np.log(4.0))))
        picture = cv2.resize(
            cv2.resize(picture, (small, small), interpolation=cv2.INTER_AREA),
            (side, side),
            interpolation=cv2.INTER_LINEAR,
        )
    if rng.random() < 0.3:
        picture = picture + rng.normal(0, np.exp(rng.uniform(np.log(0.004), np.log(0.05))), picture.shape).astype(
            np.float32
        )
    if rng.random() < 0.06:
        picture = np.repeat(picture.mean(-1, keepdims=True), 3, 2)
    return np.clip(picture, 0, 1).astype(np.float32)


def _path(work: Path, seed: int, view: int) -> Path:
    return Path(work) / f"figure_{seed}" / f"{view}.npz"


def _prepare_one(seed: int, views: int, work: Path) -> None:
    cv2.setNumThreads(1)
    figure = make_figure(seed, TEXELS)
    scene = unlit.scene_of(figure, np.random.default_rng([seed, 90]))
    _path(work, seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for view in range(views):
        rng = np.random.default_rng([seed, 91, view])
        unlit.save(_path(work, seed, view), unlit.trace_unlit(scene, unlit.random_view(figure, rng), rng))


def require_figures(training: str, data: dict, prepared: Callable[[int], bool], work: Path) -> None:
    """Refuses to learn from nothing.

    Parameters
    ----------
    training : its name in `python -m research.training NAME`
    data : with "seeds", who is learnt from, and "held_out_seeds", who is kept from it
    prepared : of a seed, whether its sights are all there
    work : folder of the sights

    Raises
    ------
    Problem
        Where none of those learnt from, or none of those kept from it, is prepared.
    """
    if not all(any(map(prepared, data[kind])) for kind in ("seeds", "held_out_seeds")):
        raise Problem(
            f"There are no figures in {work} yet.",
            f"Wait for `train {training} --prepare`, or train without --growing.",
        )


def recipe_of(options: dict, minutes: float | None) -> descent.TrainingRecipe:
    """How a network that parses pictures is trained."""
    return descent.TrainingRecipe(
        minutes or options["minutes"],
        descent.cosine(options["rate"], 100, 0.02),
        betas=(0.9, 0.98),
        weight_decay=1e-2,
        averaging=0.995,
        workers=options["workers"],
        save_every=150,
    )


def export_parsing(
    training: str, work: Path, out: Path, config: dict, words: tuple[str, str], prepared: Callable[[int], bool]
) -> dict:
    """The averaged weights of a training folder as fp16 safetensors, with the card that says where they come from.

    Parameters
    ----------
    training : its name in `python -m research.training NAME`
    work : its folder
    out : safetensors; the card is written beside it
    config : of CONFIGS, with which it was trained
    words : of whom the photographs are, and what its figures of held-out people mean
    prepared : of a seed, whether its sights are all there

    Returns
    -------
    The card.

    Raises
    ------
    Problem
        Where the folder holds no training.
    """
    state = descent.read_state(work)
    whom, what = words
    named, panoramas = state["data"], state["data"]["panoramas"]
    told = (
        f"Photographs of {whom} (research/people/lifelike) on the built-in head, which derives from the MakeHuman "
        "base mesh (CC0)"
    )
    if panoramas:
        told += f"; light from procedural environments, lamps and {len(panoramas)} panoramas (CC0)"
    command = again(training, state) + (" --hdri hdri" if panoramas else "")
    # the others were not there yet
    more = {"panoramas": panoramas, "prepared": sum(map(prepared, named["seeds"]))}
    return release(out, state, TrainingCard(config, told, command, {**state["history"][-1][2], "what": what}, more))
