# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all trainings share: AdamW by the clock, the running average of the weights, a checkpoint from which a killed
training goes on.

A training's state is a dictionary of plain numbers and tensors: config, data (what it learns from, by name), step,
seconds, history, network, optimiser, average, and what else the training keeps.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch.utils.data import DataLoader, Dataset

from core.capture.files import replacing
from core.capture.messages import Problem, Reporter

STATE = "state.pt"


@dataclass(frozen=True)
class TrainingRun:
    """What a command line asks of any training. minutes: in all, those of earlier runs included (None: the
    configuration's); work: the folder that it goes on from (None: one among the temporary ones); hdri: a folder of
    panoramas; start: weights to begin with, in place of random ones; growing: it learns from what is prepared already,
    while another process prepares more."""

    minutes: float | None = None
    work: Path | None = None
    hdri: Path | None = None
    start: Path | None = None
    growing: bool = False


@dataclass(frozen=True)
class Objective:
    """What is learnt. `batches[step]` depends on the step alone, so a resumed training draws what an unbroken one would
    have; loss(batch, step, share of the time) is a scalar; figures(averaged weights) are what the history keeps of
    held-out data."""

    batches: Dataset
    loss: Callable[..., torch.Tensor]
    figures: Callable[[dict], object]


@dataclass(frozen=True)
class TrainingRecipe:
    """minutes: in all, those of earlier runs included; rate(step, share of the time) -> learning rate; averaging: the
    longest memory of the averaged weights; workers: processes that make batches; save_every: seconds between
    checkpoints."""

    minutes: float
    rate: Callable[[int, float], float]
    betas: tuple[float, float]
    weight_decay: float
    averaging: float
    workers: int
    save_every: float


def work_folder(run: TrainingRun, training: str) -> Path:
    """The folder of a run of `train NAME`, made if it is not there."""
    work = Path(run.work or Path(tempfile.gettempdir()) / f"wildcap_{training}")
    work.mkdir(parents=True, exist_ok=True)
    return work


def device_of(config: str) -> str:
    """Every configuration but `cpu` is for a graphics card, where there is one."""
    return "cuda" if config != "cpu" and torch.cuda.is_available() else "cpu"


def cosine(rate: float, warming: int, least: float) -> Callable[[int, float], float]:
    """A learning rate that grows over the first `warming` steps, then falls along half a cosine to `least` of `rate`
    (Loshchilov and Hutter 2017)."""

    def at(step: int, share: float) -> float:
        return rate * min(1.0, (step + 1) / warming) * max(least, 0.5 + 0.5 * math.cos(math.pi * share))

    return at


def beginning(config: str, data: dict, network: torch.nn.Module, **more) -> dict:
    """The state before the first step."""
    weights = network.state_dict()
    return {
        "config": config,
        "data": data,
        "step": 0,
        "seconds": 0.0,
        "history": [],
        "network": weights,
        "optimiser": {},
        "average": {name: value.clone() for name, value in weights.items()},
        **more,
    }


def resumed(work: Path, begun: dict) -> dict:
    """The state that an earlier run left in `work`, or `begun`. Raises Problem where it learns from other data or is of
    another configuration."""
    if not (Path(work) / STATE).is_file():
        return begun
    state = begun | read_state(work)  # a training begun by an older version lacks the newer entries
    if state["data"] != begun["data"] or state["config"] != begun["config"]:
        raise Problem(
            f"The training in {work} is on other data or of another configuration.",
            "Name another --work folder, or delete this one.",
        )
    return state


def read_state(work: Path) -> dict:
    """What a training has left in `work`, on the processor. Raises Problem where there is none."""
    path = Path(work) / STATE
    if not path.is_file():
        raise Problem(f"There is no training in {work}.", "Name the --work folder of one.")
    return torch.load(path, weights_only=True, map_location="cpu")


def descend(
    network: torch.nn.Module,
    state: dict,
    objective: Objective,
    recipe: TrainingRecipe,
    work: Path,
    device: str,
    report: Reporter,
) -> None:
    """Trains until the recipe's minutes are over.

    Parameters
    ----------
    network : takes the state's weights, and moves to `device`
    state : as `resumed` gives it; changed
    objective, recipe : what is learnt, and how
    work : the folder that the state is written to
    device : cpu or cuda
    report : hears of progress in seconds
    """
    minutes = recipe.minutes
    network.load_state_dict(state["network"])
    network.to(device, memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=recipe.rate(0, 0.0), betas=recipe.betas, weight_decay=recipe.weight_decay
    )
    if state["optimiser"]:
        optimiser.load_state_dict(state["optimiser"])
    average = {name: value.to(device) for name, value in state["average"].items()}
    began, before, saved_at = time.monotonic(), state["seconds"], state["seconds"]
    loader = DataLoader(
        objective.batches,
        batch_size=None,
        sampler=range(state["step"], 10**9),
        num_workers=recipe.workers,
        prefetch_factor=3 if recipe.workers else None,
    )
    for step, batch in zip(range(state["step"], 10**9), loader, strict=False):
        share = min(1.0, state["seconds"] / (60 * minutes))
        for group in optimiser.param_groups:
            group["lr"] = recipe.rate(step, share)
        value = objective.loss(batch, step, share)
        optimiser.zero_grad(set_to_none=True)
        value.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        decay = min(recipe.averaging, (step + 1) / (step + 10))
        for name, weight in network.state_dict().items():
            average[name].lerp_(weight, 1 - decay)
        state["step"], state["seconds"] = step + 1, before + time.monotonic() - began
        ended = state["seconds"] >= 60 * minutes
        report.progress(min(state["seconds"], 60 * minutes), 60 * minutes, f"step {step + 1}")
        if state["seconds"] - saved_at > recipe.save_every or ended:
            state["history"].append([state["step"], round(state["seconds"]), objective.figures(average)])
            report.log(
                f"step {step + 1}, {state['seconds'] / 60:.1f} min, loss {value.item():.4f}, held out "
                f"{state['history'][-1][2]}"
            )
            state |= {"network": network.state_dict(), "optimiser": optimiser.state_dict(), "average": average}
            with replacing(Path(work) / STATE) as temporary:
                torch.save(state, temporary)
            saved_at = state["seconds"]
        if ended:
            return
