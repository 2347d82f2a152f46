# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The loop of all trainings: AdamW by the clock, a running average of the weights, checkpoints to continue from.

A training's state is a dictionary of plain numbers and tensors: config, data (what it learns from, by name), step,
seconds, history, network, optimiser, average, and what else the training keeps.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from core.capture.files import replacing
from core.capture.messages import Problem, Reporter

STATE = "state.pt"
STEPS = 10**9  # more than any training takes


@dataclass(frozen=True)
class Run:
    """One run of a training, as its command line describes it.

    config: name of the configuration; work: folder of prepared data and checkpoint; out: safetensors, fp16; minutes: in
    all, those of earlier runs included (None: the configuration's); hdri: folder of panoramas; skins: folder of carried
    skins, held_out: those of it that are kept from training; photographs: folder of real people; start: initial
    weights.
    """

    config: str
    work: Path
    out: Path
    minutes: float | None = None
    hdri: Path | None = None
    skins: Path | None = None
    held_out: tuple[str, ...] = ()
    photographs: Path | None = None
    start: Path | None = None


@dataclass(frozen=True)
class Recipe:
    """How a network is trained, whatever the configuration.

    warming: steps over which the learning rate grows; fall(share of the time): its factor from then on; averaging: the
    longest memory of the averaged weights; save_every: seconds between checkpoints.
    """

    warming: int
    fall: Callable[[float], float]
    betas: tuple[float, float]
    weight_decay: float
    averaging: float
    save_every: float


@dataclass(frozen=True)
class Task:
    """Training data and objective of a run.

    data: names of what is learnt from and of what is held out; draw: as in Batches; loss(network, batch, state, share
    of the time): a scalar; measure(network, state): the figures on held-out data that the history keeps; more: further
    entries of the state.
    """

    data: dict
    draw: Callable[[int, np.random.Generator], list]
    loss: Callable[..., torch.Tensor]
    measure: Callable[[torch.nn.Module, dict], object]
    more: dict = field(default_factory=dict)


class Batches(Dataset):
    """The batch of each step, by the step's number alone: a resumed training draws what an unbroken one would have.

    draw(index, rng) returns the batches of `echo` successive steps, which show the same data in several ways: where
    making data costs as much as learning from it, twice is cheaper than new. A batch is a NamedTuple of tensors.
    """

    def __init__(self, draw: Callable[[int, np.random.Generator], list], seed: int, echo: int):
        self.draw, self.seed, self.echo = draw, seed, echo
        self.index, self.drawn = -1, []

    def __getitem__(self, step: int):
        index, turn = divmod(step, self.echo)
        if index != self.index:
            self.index, self.drawn = index, self.draw(index, np.random.default_rng((self.seed, index)))
        return self.drawn[turn]


def cosine(least: float) -> Callable[[float], float]:
    """Return a fall of the learning rate along half a cosine to `least` (Loshchilov and Hutter 2017)."""
    return lambda share: max(least, 0.5 + 0.5 * math.cos(math.pi * share))


def resume(run: Run, task: Task, network: torch.nn.Module) -> dict:
    """Return the state that an earlier run left in the work folder, or the state before the first step.

    Raises Problem if the earlier run learnt from other data or had another configuration.
    """
    weights = network.state_dict()
    begun = {"config": run.config, "data": task.data, "step": 0, "seconds": 0.0, "history": [], "network": weights}
    begun |= {"optimiser": {}, "average": {name: value.clone() for name, value in weights.items()}, **task.more}
    if not (run.work / STATE).is_file():
        return begun
    state = begun | read_state(run.work)  # a training begun by an older version lacks the newer entries
    if state["data"] != task.data or state["config"] != run.config:
        raise Problem(
            f"The training in {run.work} is on other data or of another configuration.",
            "Name another --work folder, or delete this one.",
        )
    return state


def read_state(work: Path) -> dict:
    """Read the checkpoint of a work folder, on the processor. Raises Problem if there is none."""
    if not (work / STATE).is_file():
        raise Problem(f"There is no training in {work}.", "Name the --work folder of one.")
    return torch.load(work / STATE, weights_only=True, map_location="cpu")


def descend(network: torch.nn.Module, task: Task, recipe: Recipe, options: dict, run: Run, report: Reporter) -> None:
    """Train until the minutes are over; `options` are the configuration's. Reports progress in seconds."""
    # every configuration but `cpu` is for a graphics card
    device = "cuda" if run.config != "cpu" and torch.cuda.is_available() else "cpu"
    state, total = resume(run, task, network), 60 * (run.minutes or options["minutes"])
    network.load_state_dict(state["network"])
    network.to(device, memory_format=torch.channels_last)
    averaged = copy.deepcopy(network).eval()
    averaged.load_state_dict(state["average"])
    optimiser = torch.optim.AdamW(network.parameters(), betas=recipe.betas, weight_decay=recipe.weight_decay)
    if state["optimiser"]:
        optimiser.load_state_dict(state["optimiser"])
    steps, workers = range(state["step"], STEPS), options["workers"]
    batches = Batches(task.draw, options["seed"], options.get("echo", 1))
    loader = DataLoader(batches, None, sampler=steps, num_workers=workers, prefetch_factor=3 if workers else None)
    began, saved_at = time.monotonic() - state["seconds"], state["seconds"]
    for step, batch in zip(steps, loader, strict=False):
        share = min(1.0, state["seconds"] / total)
        for group in optimiser.param_groups:
            group["lr"] = options["rate"] * min(1.0, (step + 1) / recipe.warming) * recipe.fall(share)
        value = task.loss(network, batch._make(part.to(device) for part in batch), state, share)
        optimiser.zero_grad(set_to_none=True)
        value.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        decay = min(recipe.averaging, (step + 1) / (step + 10))
        for mean, weight in zip(averaged.state_dict().values(), network.state_dict().values(), strict=True):
            mean.lerp_(weight, 1 - decay)
        state["step"], state["seconds"] = step + 1, time.monotonic() - began
        ended = state["seconds"] >= total
        report.progress(min(state["seconds"], total), total, f"step {step + 1}")
        if ended or state["seconds"] - saved_at > recipe.save_every:
            saved_at = state["seconds"]
            with torch.no_grad():
                figures = task.measure(averaged, state)
            state["history"].append([step + 1, round(saved_at), figures])
            report.log(f"step {step + 1}, {saved_at / 60:.1f} min, loss {value.item():.4f}, held out {figures}")
            state |= {"network": network.state_dict(), "optimiser": optimiser.state_dict()}
            with replacing(run.work / STATE) as temporary:
                torch.save(state | {"average": averaged.state_dict()}, temporary)
        if ended:
            return
