# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the delighting network on synthetic people and portraits whose light is known.

    python -m research.training delighter --config cpu|gpu [--minutes 80] [--hdri FOLDER] [--skins FOLDER --held-out
    NAME ...] [--start FILE] [--growing] [--work DIR] python -m research.training delighter --prepare [--config cpu|gpu]
    [--work DIR] make the people's sights and stop python -m research.training delighter --export [--work DIR] [--out
    FILE]          write the running training's averaged weights now

Needs neither Blender nor the internet. A second run goes on where the first was killed. FOLDERs: panoramas (.hdr, .exr)
that may light portraits, and skins that `train carry` brought into our UVs; without them all light and skin is
procedural. --start: weights to begin with. --growing trains on the people that are there while another process prepares
the others: what is drawn then depends on when.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file
from torch.nn import functional
from torch.utils.data import Dataset

from core.capture.messages import Problem, Reporter
from core.stages.delight.unet import DelightNet
from core.stages.solve.prior_files import fast_dtype

from . import command_line, descent
from .people import People, is_prepared, prepare_people
from .portraits import PortraitBatch, Portraits, mirrored, prepare, repainted
from .prior import named_data
from .release import TrainingCard, again, release
from .seeds import held_out_seeds, panorama_names, training_seeds
from .shading_errors import disagreement, mean_deviation, mean_size, slope_error, split_tone

WEIGHTS = Path(__file__).resolve().parent.parent / "weights" / "delighter.safetensors"
_MODEL = {"widths": [64, 128, 192, 224], "depths": [2, 2, 2, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": {
            "pairs": 2,
            "echo": 2,
            "rate": 4e-4,
            "minutes": 180,
            "skins": 48,
            "people": 120,
            "views": 8,
            "held_out": 6,
            "seed": 0,
            "workers": 1,
        },
    },
    "gpu": {
        "model": _MODEL,
        "training": {
            "pairs": 16,
            "echo": 1,
            "rate": 1.0e-3,
            "minutes": 24,
            "skins": 160,
            "people": 360,
            "views": 8,
            "held_out": 6,
            "seed": 0,
            "workers": 14,
        },
    },
}
"""`people`, and `skins` bald subjects, are seen from `views` sides each; a step shows `pairs` of them under two lights
each. Every `echo` steps show the same, mirrored and painted over in turn: where making them costs as much as learning
from them, twice is cheaper than new."""
SCRATCH = "random weights"
PEOPLE = 0.7
"""Share of the steps that show people; the others show bald subjects, whose maps are finer."""
TONE, SLOPE, AGREEMENT, SHADOW = 0.25, 1.0, 0.25, 0.3
"""Weights beside the log-shading's error: its mean over the face, its slopes, the albedo of one face under two lights,
the shadows."""


def train_delighter(
    config: str,
    out: Path,
    report: Reporter,
    run: descent.TrainingRun,
    skins: Path | None = None,
    held_out: list[str] = (),
) -> dict:
    """Trains the delighter; preparation does not count into its minutes.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, fp16; its card is written beside it
    report : hears of progress
    run : minutes, folders, what it begins with
    skins : folder of skins that `train carry` brought into our UVs
    held_out : skins of that folder that are kept from training

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where the work folder holds a training on other data, or, growing, no people yet
    """
    hdri, start = run.hdri, run.start
    work, t, device = descent.work_folder(run, "delighter"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_data(t, skins, held_out) | {
        "panoramas": panorama_names(hdri),
        "people": training_seeds(t["people"]),
        "started": "the weights before" if start else SCRATCH,
    }
    if not run.growing:
        prepare_delighter(config, work, report)
    if not all(
        any(is_prepared(seed, t["views"], work) for seed in data[kind]) for kind in ("people", "held_out_seeds")
    ):
        raise Problem(
            f"There are no people in {work} yet.", "Wait for `train delighter --prepare`, or train without --growing."
        )
    prepare(data["seeds"], t["views"], work, report, skins, data["skins"], max(2, t["workers"]))
    prepare(data["held_out_seeds"], t["views"], work, report)
    unseen = {
        "": Portraits(data["held_out_seeds"], t["views"], work, hdri).draw(
            4 * t["held_out"], np.random.default_rng(1), augment=False
        ),
        "people_": People(data["held_out_seeds"], t["views"], work, hdri).draw(
            4 * t["held_out"], np.random.default_rng(1)
        ),
    }
    torch.manual_seed(t["seed"])
    network = DelightNet(**CONFIGS[config]["model"])
    if start:
        network.load_state_dict({name: value.float() for name, value in load_file(start).items()})
    state = descent.resumed(work, descent.beginning(config, data, network))
    recipe = descent.TrainingRecipe(
        run.minutes or t["minutes"],
        descent.cosine(t["rate"], 200, 0.01),
        betas=(0.9, 0.98),
        weight_decay=1e-2,
        averaging=0.998,
        workers=t["workers"],
        save_every=600,
    )
    objective = descent.Objective(
        _DelighterSteps(
            Portraits(data["seeds"], t["views"], work, hdri), People(data["people"], t["views"], work, hdri), t
        ),
        lambda batch, step, share: sum(losses(network, batch, device).values()),
        lambda average: {
            kind + name: value
            for kind, batch in unseen.items()
            for name, value in measure_figures(average, config, batch, device).items()
        },
    )
    descent.descend(network, state, objective, recipe, work, device, report)
    return export(work, out)


def prepare_delighter(config: str, work: Path, report: Reporter) -> None:
    """The sights of all people, those of the held-out ones first."""
    t = CONFIGS[config]["training"]
    work.mkdir(parents=True, exist_ok=True)
    prepare_people(
        held_out_seeds(t["held_out"]) + training_seeds(t["people"]), t["views"], work, report, max(2, t["workers"])
    )


def losses(network: DelightNet, batch: PortraitBatch, device: str) -> dict[str, torch.Tensor]:
    """The terms of the loss, each a scalar."""
    with torch.autocast(device, torch.bfloat16, enabled=_fast(device)):
        shading, shadow = network(batch.layers.to(device, memory_format=torch.channels_last))
    weight = batch.weight.to(device)
    tone, error = split_tone(shading - batch.shading.to(device), weight)
    terms = {
        "shading": mean_size(error, weight),
        "tone": TONE * tone.abs().mean(),
        "slope": SLOPE * slope_error(error, weight),
        "agreement": AGREEMENT * disagreement(error, weight),
    }
    lost = functional.binary_cross_entropy_with_logits(shadow, batch.shadow.to(device), reduction="none")
    sure = batch.shadow_weight.to(device)
    terms["shadow"] = SHADOW * (lost * sure).sum() / sure.sum().clamp_min(1)
    return terms


def _fast(device: str) -> bool:
    """Whether bfloat16 is the faster type there."""
    return device == "cuda" or fast_dtype("cpu") == torch.bfloat16


@torch.no_grad()
def measure_figures(average: dict, config: str, batch: PortraitBatch, device: str) -> dict[str, float]:
    """The averaged network on held-out portraits, with and without geometry, beside the picture as it is.

    Parameters
    ----------
    average : its weights
    config : one of CONFIGS
    batch : the portraits; those whose geometry is known count
    device : on which it runs

    Returns
    -------
    geometry, picture, none: mean absolute error of the log-albedo about its own mean over the skin, natural log;
    iou_geometry, iou_picture: intersection over union of the shadows.
    """
    network = DelightNet(**CONFIGS[config]["model"])
    network.load_state_dict(average)
    network.to(device, memory_format=torch.channels_last)
    told = {}
    layers = batch.layers.clone()
    for name in ("geometry", "picture"):
        if name == "picture":
            layers[:, 6:] = 0
        chosen = batch.layers[:, 15].amax((1, 2)) > 0
        with torch.autocast(device, torch.bfloat16, enabled=_fast(device)):
            answers = [network(rows.to(device, memory_format=torch.channels_last)) for rows in layers[chosen].split(8)]
        shading, shadow = (torch.cat([answer[k].cpu() for answer in answers]) for k in (0, 1))
        told[name] = mean_deviation(shading - batch.shading[chosen], batch.weight[chosen])
        predicted, true, sure = shadow > 0, batch.shadow[chosen] > 0.5, batch.shadow_weight[chosen] > 0.9
        told[f"iou_{name}"] = ((predicted & true & sure).sum() / ((predicted | true) & sure).sum().clamp_min(1)).item()
    told["none"] = mean_deviation(batch.shading[chosen], batch.weight[chosen])
    return {name: round(float(value), 4) for name, value in told.items()}


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights of a training folder as fp16 safetensors, with the card that says where they come from."""
    state = descent.read_state(work)
    data = state["data"]
    told = (
        "Synthetic people with hair, beards and open eyes (research/people/lifelike) and portraits of bald subjects "
        "(research/people) on the built-in head, "
        "which derives from the MakeHuman base mesh (CC0)"
    )
    if data["skins"]:
        told += f"; some wear one of {len(data['skins'])} skins of {data['from']}, carried into the built-in UVs"
    if data["panoramas"]:
        told += f"; light from procedural environments, lamps and {len(data['panoramas'])} panoramas (CC0)"
    what = (
        "portraits of held-out subjects, and people_ of held-out people: mean error of the log-albedo about its "
        "own mean over the skin (natural log), "
        "told the geometry or the picture only, beside the picture as it is; intersection over union of the shadows"
    )
    command = again("delighter", state) + (" --hdri hdri" if data["panoramas"] else "")
    if data["started"] != SCRATCH:
        command += " --start delighter.safetensors"
    # the others were not there yet
    ready = sum(is_prepared(seed, CONFIGS[state["config"]]["training"]["views"], work) for seed in data["people"])
    more = {"panoramas": data["panoramas"], "people": data["people"][:ready], "started": data["started"]}
    return release(
        out,
        state,
        TrainingCard(CONFIGS[state["config"]], told, command, {**state["history"][-1][2], "what": what}, more),
    )


class _DelighterSteps(Dataset):
    """The batch of each step: it depends on the step alone, so a resumed training draws what an unbroken one would
    have."""

    def __init__(self, portraits: Portraits, people: People, options: dict):
        self.portraits, self.people, self.options = portraits, people, options
        self.drawn: tuple[int, PortraitBatch | None] = -1, None

    def __getitem__(self, step: int) -> PortraitBatch:
        torch.set_num_threads(1)
        index = step // self.options["echo"]
        rng = np.random.default_rng((self.options["seed"], index))
        if self.drawn[0] != index:
            self.drawn = (
                index,
                (self.people if rng.random() < PEOPLE else self.portraits).draw(self.options["pairs"], rng),
            )
        turned = step % 2 if self.options["echo"] > 1 else rng.random() < 0.5
        if not turned:
            return self.drawn[1]
        return mirrored(repainted(self.drawn[1], np.random.default_rng((self.options["seed"], index, step))))


def main(arguments: list[str] | None = None) -> int:
    options = command_line.make_parser("delighter", __doc__, CONFIGS, WEIGHTS)
    command_line.add_skins(options)
    command_line.add_sights(options, "people")
    options.add_argument("--start", type=Path, metavar="FILE", help="weights to begin with, in place of random ones")
    return command_line.carry_out(options, arguments, train_delighter, export, prepare_delighter)


if __name__ == "__main__":
    raise SystemExit(main())
