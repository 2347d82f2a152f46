# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the trainings of networks share: their command line, and the weights and card that they end with."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file

from core.capture.files import replacing, write_json
from core.capture.messages import Log, Reporter
from core.capture.shipped_files import CORE

from .descent import Recipe, Run, Task, descend, read_state

OPTIONS = {
    "hdri": dict(type=Path, metavar="FOLDER", help="panoramas whose licence lets weights trained with them be shipped"),
    "skins": dict(type=Path, metavar="FOLDER", help="skins that `carry` brought into our UVs"),
    "held-out": dict(
        nargs="+", default=(), metavar="NAME", help="skins of FOLDER kept from training, each with its cluster"
    ),
    "photographs": dict(type=Path, metavar="FOLDER", help="london_faces: photographs of real people in one light"),
    "start": dict(type=Path, metavar="FILE", help="weights to begin with, in place of random ones"),
}
"""Options that only some trainings have."""


@dataclass(frozen=True)
class Card:
    """The training-specific entries of the JSON beside the weights.

    subject: what is learnt from; measure: what the held-out figures are; held_out: the figures, by default the last of
    the history; skins_use: what is done with carried skins; started: options of the command that the data do not
    imply; config: changes of the configuration; more: further entries; weights: in place of the averaged ones, tensors:
    written beside them as they are.
    """

    subject: str
    measure: str
    held_out: dict | None = None
    skins_use: str = ""
    started: str = ""
    config: dict = field(default_factory=dict)
    more: dict = field(default_factory=dict)
    weights: dict[str, torch.Tensor] | None = None
    tensors: dict[str, torch.Tensor] = field(default_factory=dict)


@dataclass(frozen=True)
class Training:
    """A network that `python -m research.training NAME` trains.

    build(configuration) makes the network; prepare(run, options, report) makes what is kept in the work folder, and may
    be run alone; start(run, options, report) then opens the data; describe(state) returns the card's entries; options:
    of OPTIONS; load(network, weights) starts from earlier weights.
    """

    name: str
    configs: dict
    recipe: Recipe
    build: Callable[[dict], torch.nn.Module]
    start: Callable[[Run, dict, Reporter], Task]
    describe: Callable[[dict], Card]
    prepare: Callable[[Run, dict, Reporter], None] | None = None
    options: tuple[str, ...] = ()
    load: Callable[[torch.nn.Module, dict], object] = torch.nn.Module.load_state_dict


def run_command(training: Training, description: str, arguments: list[str]) -> None:
    """Train, prepare or export, as a command line says."""
    parser = make_parser(training.name, description)
    parser.add_argument("--config", default="cpu", choices=tuple(training.configs))
    parser.add_argument("--minutes", type=float, help="in all, those of earlier runs included")
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / f"wildcap_{training.name}")
    parser.add_argument("--out", type=Path, default=CORE / "weights" / f"{training.name}.safetensors")
    parser.add_argument("--export", action="store_true", help="write the weights of the last checkpoint and stop")
    if training.prepare:
        parser.add_argument("--prepare", action="store_true", help="make what the training learns from and stop")
    for option in training.options:
        parser.add_argument(f"--{option}", **OPTIONS[option])
    flags = vars(parser.parse_args(arguments))
    exports, prepares = flags.pop("export"), flags.pop("prepare", False)
    run = Run(**flags)
    report = Reporter(
        "train", emit=lambda message: print(message.text, flush=True) if isinstance(message, Log) else None
    )
    if exports:
        export(training, run.work, run.out)
    elif prepares:
        training.prepare(run, training.configs[run.config]["training"], report)
    else:
        train(training, run, report)


def make_parser(name: str, description: str) -> argparse.ArgumentParser:
    """Return the parser of `python -m research.training NAME`; `description` is the module's docstring."""
    return argparse.ArgumentParser(
        f"python -m research.training {name}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def train(training: Training, run: Run, report: Reporter) -> dict:
    """Train a network, or continue to; preparation does not count into its minutes. Returns the card.

    Raises Problem if the work folder holds a training on other data.
    """
    run.work.mkdir(parents=True, exist_ok=True)
    config = training.configs[run.config]
    options = config["training"]
    if training.prepare:
        training.prepare(run, options, report)
    torch.manual_seed(options["seed"])
    network = training.build(config)
    if run.start:
        training.load(network, {name: value.float() for name, value in load_file(run.start).items()})
    descend(network, training.start(run, options, report), training.recipe, options, run, report)
    return export(training, run.work, run.out)


def export(training: Training, work: Path, out: Path) -> dict:
    """Write the averaged weights of a work folder as fp16 safetensors, and their card beside them. Returns the card."""
    state = read_state(work)
    data, card = state["data"], training.describe(state)
    weights = card.weights or state["average"]
    with replacing(out) as temporary:
        save_file({name: value.half().contiguous() for name, value in weights.items()} | card.tensors, temporary)
    source = f"{card.subject} on the built-in head, which derives from the MakeHuman base mesh (CC0)"
    command = f"python -m research.training {training.name} --config {state['config']}"
    command += f" --minutes {round(state['seconds'] / 60)}"
    if data["skins"]:
        source += "; " + card.skins_use.format(f"{len(data['skins'])} skins of {data['from']}")
        command += f" --skins {data['from']}_carried --held-out {' '.join(data['held_out_skins'])}"
    if data.get("panoramas"):
        source += f"; light from procedural environments, lamps and {len(data['panoramas'])} panoramas (CC0)"
        command += " --hdri hdri"
    content = {
        **training.configs[state["config"]],
        **card.config,
        "data": source,
        "licence": "GPL-3.0-or-later",
        "notices": data["notices"],
        "command": command + card.started,
        "steps": state["step"],
        "minutes": round(state["seconds"] / 60, 1),
        "parameters": sum(value.numel() for value in weights.values()),
        **{name: data[name] for name in ("seeds", "held_out_seeds", "skins", "held_out_skins")},
        "held_out": {**(card.held_out or state["history"][-1][2]), "what": card.measure},
        **card.more,
    }
    write_json(out.with_suffix(".json"), content)
    return content
