# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the network of the texels learns from: people and props that are prepared in a work folder, and batches of
them."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import torch

from ..contract.messages import Reporter
from ..delight.texel_net import network_input
from ..face import template
from ..synthetic import unfolded
from .crowd import Crowd, gather_crowd, joined, paint_anew
from .dice import Dice
from .props import load_props, make_props, save_props
from .unfolded import LitPeople, light_up

PROPS = "props.npz"
PROCESSES = max(2, os.cpu_count() or 2)
OFF_FACE = 0.3
"""How much scalp, ears and neck count beside the face."""


@dataclass(frozen=True)
class TexelBatch:
    """layers [N, CHANNELS, S, S] and light [N, 6, S, S]; shading [N, 3, S, S] the true log-shading less the face's mean
    log colour, weight [N, 1, S, S] of its error; shadow and shadow_weight [N, 1, S, S]. 2 k and 2 k + 1 are the same
    person and colours under two lights."""

    layers: torch.Tensor
    light: torch.Tensor
    shading: torch.Tensor
    weight: torch.Tensor
    shadow: torch.Tensor
    shadow_weight: torch.Tensor


class UnfoldedPeople:
    """Draws batches of the people that are prepared in a work folder, on a device."""

    def __init__(self, seeds: list[int], work: Path, device: str):
        self.seeds, self.work, self.device = seeds, work, device
        self.props = load_props(work / PROPS).to(device)
        self.there: list[int] = []
        self.crowd: Crowd | None = None
        self.look_again()

    def look_again(self) -> None:
        """Takes in who has been prepared since."""
        new = [seed for seed in self.seeds if seed not in self.there and person_path(self.work, seed).is_file()]
        if new:
            come = gather_crowd([unfolded.load(person_path(self.work, seed)) for seed in new], self.device)
            self.crowd = joined(self.crowd, come) if self.crowd else come
            self.there += new

    def draw(self, pairs: int, side: int, rng: np.random.Generator) -> TexelBatch:
        """`pairs` of them, in colours of their own, under two lights each."""
        dice = Dice(rng, self.device)
        who = dice.whole(len(self.crowd), pairs)
        albedo = paint_anew(self.crowd, who, self.props, side, dice)
        return example(light_up(self.crowd, who.repeat_interleave(2), albedo.repeat_interleave(2, 0), self.props, dice))


def example(lit: LitPeople) -> TexelBatch:
    """What the network is told of people under a light, and what it is to find."""
    layers, light, middle = network_input(lit.maps)
    face = torch.from_numpy(template.mask("face", layers.shape[-1])).to(layers)
    weight = (lit.maps.seen / 0.15).clamp(0, 1) * (OFF_FACE + (1 - OFF_FACE) * face)
    strong = lit.strong[:, None, None, None]
    # in between it is a matter of taste what is a shadow
    trust = torch.where((strong > 0.4) | (strong < 0.1), 1.0, 0.3)
    return TexelBatch(layers, light, lit.shading - middle, weight, lit.shadow * (strong > 0.2), trust * weight)


def mirrored(batch: TexelBatch) -> TexelBatch:
    """Left and right exchanged; a normal's x changes its sign."""
    layers = batch.layers.flip(-1)  # a copy
    layers[:, 5] *= -1
    return replace(batch, layers=layers,
                   **{name: getattr(batch, name).flip(-1)
                      for name in ("light", "shading", "weight", "shadow", "shadow_weight")})


def is_prepared(seeds: list[int], work: Path) -> bool:
    """Whether any of these people is there."""
    return any(person_path(work, seed).is_file() for seed in seeds)


def prepare_people(seeds: list[int], work: Path, report: Reporter, processes: int = PROCESSES) -> None:
    """Makes those of these people that the work folder lacks, in this order."""
    Path(work).mkdir(parents=True, exist_ok=True)
    jobs = [(seed, work) for seed in seeds if not person_path(work, seed).is_file()]
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for i, _ in enumerate(pool.map(_prepare_one, jobs)):
            report.progress(i + 1, len(jobs), f"person {i + 1} of {len(jobs)}")


def prepare_props(count: int, work: Path, panoramas: Path | None, seed: int) -> None:
    """Draws the props that the work folder lacks."""
    if not (work / PROPS).is_file():
        save_props(work / PROPS, make_props(count, panoramas, seed, PROCESSES))


def person_path(work: Path, seed: int) -> Path:
    return Path(work) / f"person_{seed}.npz"


def _prepare_one(job: tuple[int, Path]) -> None:
    seed, work = job
    cv2.setNumThreads(1)
    unfolded.save(person_path(work, seed), unfolded.make_person(seed))
