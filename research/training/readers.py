# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the trainings of the face parser and of the eye reader share: networks that label each pixel of a crop.

They learn from photographs of synthetic people: a sight is lit, recoloured, covered and photographed anew for every
step, then cropped and degraded in several ways.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np
import torch
from torch.nn import functional

from core.capture.messages import Reporter
from core.face.parser_network import ParseNet

from ..people.environments import read_panoramas
from .descent import Recipe, Run, Task, cosine
from .networks import Card, Training
from .seeds import named_subjects, panorama_names
from .sights import SightStore, Source, stack_examples

RECIPE = Recipe(100, cosine(0.02), (0.9, 0.98), weight_decay=1e-2, averaging=0.995, save_every=150)
TEXELS = 512  # of a figure's maps: pixels of a crop are larger than theirs


class LabelBatch(NamedTuple):
    """Crops: layers [N, CHANNELS, S, S]; shares [N, C, S, S] of the classes, which add up to one where known is 1."""

    layers: torch.Tensor
    shares: torch.Tensor
    known: torch.Tensor  # [N, 1, S, S]


@dataclass(frozen=True)
class Jitter:
    """Standard deviations of a crop's place: shift in crops, scale as a logarithm, turn in degrees."""

    shift: float
    scale: float
    turn_deg: float


@dataclass(frozen=True)
class Focus:
    """Classes of few pixels: each pixel near one, whatever it is, counts 1 + weight times."""

    classes: list[int]
    weight: float
    reach: int  # pixels


@dataclass(frozen=True)
class Reader:
    """The training of a network that labels pixels.

    count(options): sights of each figure; shoot: as in Source; crops: held-out ones of each figure; groups:
    classes whose intersection over union is measured, by name; subject, measured: for the card.
    """

    name: str
    configs: dict
    count: Callable[[dict], int]
    make_sights: Callable[[SightStore, int], None]
    shoot: Callable
    classes: int
    focus: Focus
    crops: int
    groups: dict[str, list[int]]
    subject: str
    measured: str

    def training(self) -> Training:
        return Training(self.name, self.configs, RECIPE, self.build, self.start, self.describe, self.prepare, ("hdri",))

    def build(self, config: dict) -> ParseNet:
        return ParseNet(**config["model"], parts=self.classes)

    def open(self, run: Run, options: dict) -> tuple[SightStore, dict]:
        """Return the store of the figures' sights, and the names of the data."""
        data = named_subjects(options["figures"], options["held_out"]) | {"panoramas": panorama_names(run.hdri)}
        return SightStore(run.work, "figure", self.count(options)), data

    def prepare(self, run: Run, options: dict, report: Reporter) -> None:
        """Make the sights of all figures, those of the held-out ones first."""
        store, data = self.open(run, options)
        store.prepare(data["held_out_seeds"] + data["seeds"], self.make_sights, report)

    def start(self, run: Run, options: dict, report: Reporter) -> Task:
        """Open the photographs."""
        store, data = self.open(run, options)
        source = Source(store, data["seeds"], self.shoot, read_panoramas(run.hdri))
        unseen = replace(source, seeds=data["held_out_seeds"])
        held_out = draw(unseen, self.crops * options["held_out"], 1, np.random.default_rng(1), augment=False)[0]
        return Task(
            data,
            partial(_draw_step, source, options),
            lambda network, batch, state, share: self.loss(network, batch),
            lambda network, state: self.measure(network, held_out),
        )

    def loss(self, network: torch.nn.Module, batch: LabelBatch) -> torch.Tensor:
        """Return the cross-entropy of the shares, a scalar."""
        layers, focus = batch.layers.contiguous(memory_format=torch.channels_last), self.focus
        with torch.autocast(layers.device.type, torch.bfloat16, enabled=layers.is_cuda):
            logits = network(layers)
        error = -(batch.shares * functional.log_softmax(logits, 1)).sum(1, keepdim=True)
        small = batch.shares[:, focus.classes].sum(1, keepdim=True)
        near = functional.max_pool2d(small, 2 * focus.reach + 1, 1, focus.reach)
        weight = batch.known * (1 + focus.weight * near)
        return (error * weight).sum() / weight.sum().clamp_min(1)

    def measure(self, network: torch.nn.Module, batch: LabelBatch) -> dict[str, float]:
        """Return the intersection over union of each group, where a pixel is of the class that most of it is."""
        device = next(network.parameters()).device
        predicted = torch.cat([network(chunk.to(device)).argmax(1).cpu() for chunk in batch.layers.split(8)])
        true, known = batch.shares.argmax(1), batch.known[:, 0] > 0.5
        figures = {}
        for name, classes in self.groups.items():
            a, b = (torch.isin(labels, torch.tensor(classes)) & known for labels in (predicted, true))
            figures[name] = round(float((a & b).sum() / (a | b).sum().clamp_min(1)), 4)
        return figures

    def describe(self, state: dict) -> Card:
        data = state["data"]
        more = {"panoramas": data["panoramas"], "prepared": len(data["seeds"])}
        return Card(f"Photographs of {self.subject} (research/people/lifelike)", self.measured, more=more)


def _draw_step(source: Source, options: dict, index: int, rng: np.random.Generator) -> list[LabelBatch]:
    return draw(source, options["batch"], options["echo"], rng)


def draw(source: Source, count: int, echo: int, rng: np.random.Generator, augment: bool = True) -> list[LabelBatch]:
    """Return `echo` batches of the same `count` photographs, each cropped and degraded in its own way.

    Without `augment`, crops are as the landmarks say, neither mirrored nor degraded.
    """
    examples = source.draw(count, rng, echo=echo, augment=augment)
    return [stack_examples(LabelBatch, examples[turn::echo]) for turn in range(echo)]


def jitter_crop(move: np.ndarray, side: int, spread: Jitter, rng: np.random.Generator) -> np.ndarray:
    """Return a map from picture to crop [2, 3], in pixels, as if its landmarks lay a little elsewhere."""
    turn, scale = np.radians(rng.normal(0, spread.turn_deg)), np.exp(rng.normal(0, spread.scale))
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    about = np.array([[c, s], [-s, c]])
    middle = np.full(2, side / 2)
    shift = middle - about @ middle + rng.normal(0, spread.shift * side, 2)
    return np.concatenate([about @ move[:, :2], (about @ move[:, 2] + shift)[:, None]], 1)


def degrade(picture: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Change the white balance and gamma of a crop sRGB [S, S, 3], its resolution, noise and colour, now and then."""
    side = len(picture)
    if rng.random() < 0.6:
        gamma, gain = np.exp(rng.normal(0, 0.2)), np.exp(rng.normal(0, 0.1, 3) + rng.normal(0, 0.15))
        picture = np.clip(picture, 0, 1) ** np.float32(gamma) * gain.astype(np.float32)
    if rng.random() < 0.35:
        small = int(side / np.exp(rng.uniform(np.log(1.2), np.log(4.0))))
        picture = cv2.resize(picture, (small, small), interpolation=cv2.INTER_AREA)
        picture = cv2.resize(picture, (side, side), interpolation=cv2.INTER_LINEAR)
    if rng.random() < 0.3:
        noise = np.exp(rng.uniform(np.log(0.004), np.log(0.05)))
        picture = picture + rng.normal(0, noise, picture.shape).astype(np.float32)
    if rng.random() < 0.06:
        picture = np.repeat(picture.mean(-1, keepdims=True), 3, 2)
    return np.clip(picture, 0, 1).astype(np.float32)
