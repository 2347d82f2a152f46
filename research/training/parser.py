# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the face parser on photographs of synthetic people, whose parts are known.

    python -m research.training parser --config cpu|gpu [--minutes 60] [--hdri FOLDER] [--growing] [--work DIR]
    python -m research.training parser --prepare [--config cpu|gpu] [--work DIR]      make the figures' sights and stop
    python -m research.training parser --export [--work DIR] [--out FILE]             write the running training's
    averaged weights now

Needs neither Blender nor the internet. A second run goes on where the first was killed. FOLDER: panoramas (.hdr, .exr)
that may light photographs; without them all light is made. --growing trains on the figures that are there while another
process prepares the others: what is drawn then depends on when.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch.nn import functional

from core.capture.messages import Reporter
from core.face.parser_network import ParseNet
from core.face.parts import PARTS

from . import command_line, descent
from .seeds import named_subjects, panorama_names
from .snapshots import (
    Echoed,
    SnapshotBatch,
    Snapshots,
    export_parsing,
    is_prepared,
    prepare,
    recipe_of,
    require_figures,
)

WEIGHTS = Path(__file__).resolve().parent.parent / "weights" / "parser.safetensors"
_MODEL = {"widths": [40, 64, 112, 144], "depths": [1, 1, 1, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": {
            "batch": 8,
            "echo": 3,
            "rate": 8e-4,
            "minutes": 60,
            "figures": 360,
            "views": 10,
            "held_out": 6,
            "seed": 0,
            "workers": 1,
        },
    },
    "gpu": {
        "model": _MODEL,
        "training": {
            "batch": 32,
            "echo": 1,
            "rate": 2e-3,
            "minutes": 30,
            "figures": 720,
            "views": 10,
            "held_out": 6,
            "seed": 0,
            "workers": 14,
        },
    },
}
"""A step shows `batch` crops; every `echo` steps show the same photographs, cropped and spoilt in other ways: making
them costs as much as learning."""
SMALL = ("lips", "brows", "eyes", "beard")
"""Parts of few pixels: what lies near one of them counts NEAR times more, whatever it is, so that their shares stay
what they are."""
NEAR, REACH = 3.0, 7


def train_parser(config: str, out: Path, report: Reporter, run: descent.TrainingRun) -> dict:
    """Trains the parser; preparation does not count into its minutes.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, fp16; its card is written beside it
    report : hears of progress
    run : minutes and folders; it always begins with random weights

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where the work folder holds a training on other data, or, growing, none of its figures yet
    """
    hdri = run.hdri
    work, t, device = descent.work_folder(run, "parser"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_subjects(t["figures"], t["held_out"]) | {"panoramas": panorama_names(hdri)}
    if not run.growing:
        prepare_figures(config, work, report)
    require_figures("parser", data, lambda seed: is_prepared(seed, t["views"], work), work)
    unseen = Snapshots(data["held_out_seeds"], t["views"], work, hdri).draw(
        8 * t["held_out"], 1, np.random.default_rng(1), augment=False
    )[0]
    torch.manual_seed(t["seed"])
    network = ParseNet(**CONFIGS[config]["model"])
    state = descent.resumed(work, descent.beginning(config, data, network))
    objective = descent.Objective(
        Echoed(Snapshots(data["seeds"], t["views"], work, hdri), t),
        lambda batch, step, share: loss(network, batch, device),
        lambda average: measure_figures(average, config, unseen, device),
    )
    descent.descend(network, state, objective, recipe_of(t, run.minutes), work, device, report)
    return export(work, out)


def prepare_figures(config: str, work: Path, report: Reporter) -> None:
    """The sights of all figures, those of the held-out ones first."""
    t = CONFIGS[config]["training"]
    named = named_subjects(t["figures"], t["held_out"])
    work.mkdir(parents=True, exist_ok=True)
    prepare(named["held_out_seeds"] + named["seeds"], t["views"], work, report)


def loss(network: ParseNet, batch: SnapshotBatch, device: str) -> torch.Tensor:
    """The cross-entropy of the shares, of which pixels near small parts have more than their number."""
    with torch.autocast(device, torch.bfloat16, enabled=device == "cuda"):
        logits = network(batch.layers.to(device, memory_format=torch.channels_last))
    shares = batch.shares.to(device)
    wrong = -(shares * functional.log_softmax(logits, 1)).sum(1, keepdim=True)
    small = shares[:, [PARTS.index(name) for name in SMALL]].sum(1, keepdim=True)
    weight = batch.known.to(device) * (1 + NEAR * functional.max_pool2d(small, 2 * REACH + 1, 1, REACH))
    return (wrong * weight).sum() / weight.sum().clamp_min(1)


@torch.no_grad()
def measure_figures(average: dict, config: str, batch: SnapshotBatch, device: str) -> dict[str, float]:
    """The averaged network on photographs of held-out figures, where a part is what most of a pixel is.

    Parameters
    ----------
    average : its weights
    config : one of CONFIGS
    batch : the photographs
    device : on which it runs

    Returns
    -------
    Intersection over union by part.
    """
    network = ParseNet(**CONFIGS[config]["model"])
    network.load_state_dict(average)
    network.to(device, memory_format=torch.channels_last).eval()
    predicted = torch.cat([network(chunk.to(device)).argmax(1).cpu() for chunk in batch.layers.split(8)])
    true, known = batch.shares.argmax(1), batch.known[:, 0] > 0.5
    told = {}
    for k, name in enumerate(PARTS):
        both, either = ((predicted == k) & (true == k) & known).sum(), (((predicted == k) | (true == k)) & known).sum()
        told[name] = round(float(both / either.clamp_min(1)), 4)
    return told


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights of a training folder, with their card."""
    config = CONFIGS[descent.read_state(work)["config"]]
    words = (
        "synthetic people",
        "photographs of held-out figures: intersection over union of each part, "
        "where a part is what most of a pixel is",
    )
    return export_parsing(
        "parser", work, out, config, words, lambda seed: is_prepared(seed, config["training"]["views"], work)
    )


def main(arguments: list[str] | None = None) -> int:
    options = command_line.make_parser("parser", __doc__, CONFIGS, WEIGHTS)
    command_line.add_sights(options, "figures")
    return command_line.carry_out(options, arguments, train_parser, export, prepare_figures)


if __name__ == "__main__":
    raise SystemExit(main())
