# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the delighting network of the head's own UV space on synthetic people whose light is known.

    python -m core train texels --config cpu|gpu [--minutes 45] [--hdri FOLDER] [--start FILE] [--growing] [--work DIR]
    python -m core train texels --prepare [--config cpu|gpu] [--work DIR]   make the people and stop
    python -m core train texels --export [--work DIR] [--out FILE]          write the running training's averaged
    weights now

Needs neither Blender nor the internet. A second run goes on where the first was killed. FOLDER: panoramas (.hdr, .exr)
that may light people; without it all light is procedural. --start: weights to begin with. --growing trains on the
people that are there while another process makes the others.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file
from torch.nn import functional
from torch.utils.data import Dataset

from ..contract.messages import Problem, Reporter
from ..delight.packed import pack, unpack
from ..delight.texel_net import BAND_TEXELS, TexelNet
from ..delight.texels import SIDE_TEXELS
from ..solve.prior import fast_dtype
from . import command_line, descent
from .release import TrainingCard, again, card_before, release
from .seeds import named_subjects, panorama_names
from .shading_errors import disagreement, mean_deviation, mean_size, slope_error, split_tone
from .texel_batches import (
    TexelBatch,
    UnfoldedPeople,
    is_prepared,
    mirrored,
    person_path,
    prepare_people,
    prepare_props,
)

WEIGHTS = Path(__file__).resolve().parent.parent / "weights" / "texels.safetensors"
_MODEL = {"widths": [48, 80, 128, 160], "depths": [1, 2, 2, 2]}
CONFIGS = {
    "cpu": {"model": _MODEL,
            "training": {"pairs": 2, "fine_every": 6, "rate": 3e-4, "minutes": 45, "people": 96, "props": 96,
                         "held_out": 6, "seed": 0}},
    "gpu": {"model": _MODEL,
            "training": {"pairs": 16, "fine_every": 2, "rate": 1e-3, "minutes": 11, "people": 240, "props": 240,
                         "held_out": 6, "seed": 0}},
}
"""A step shows `pairs` of the people under two lights each at half the maps' side, where four fit into the time of one;
every `fine_every`th step shows a pair at the whole."""
TONE, SLOPE, AGREEMENT, SHADOW, SPREAD = 0.25, 1.0, 0.25, 0.2, 0.05
"""Weights beside the log-shading's error: its mean over the face, its slopes, the albedo of one person under two
lights, the shadows, and how well the size of the error is foretold."""
LOOK_EVERY = 50
"""Steps after which a growing training takes in who has been prepared since."""


def train_texels(config: str, out: Path, report: Reporter, run: descent.TrainingRun) -> dict:
    """Trains the network of the texels; preparation does not count into its minutes.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, packed; its card is written beside it
    report : hears of progress
    run : minutes, folders, what it begins with

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where the work folder holds a training on other data, or, growing, no people yet
    """
    hdri, start = run.hdri, run.start
    work, t, device = descent.work_folder(run, "texels"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_subjects(t["people"], t["held_out"]) | {
        "panoramas": panorama_names(hdri), "started": "the weights before" if start else "random weights",
        "before": card_before(start)}
    if not run.growing:
        prepare(config, work, report)
    if not all(is_prepared(data[kind], work) for kind in ("seeds", "held_out_seeds")):
        raise Problem(f"There are no people in {work} yet.",
                      "Wait for `train texels --prepare`, or train without --growing.")
    prepare_props(t["props"], work, hdri, t["seed"])
    unseen = UnfoldedPeople(data["held_out_seeds"], work, device).draw(2 * t["held_out"], SIDE_TEXELS // 2,
                                                                       np.random.default_rng(1))
    torch.manual_seed(t["seed"])
    network = TexelNet(**CONFIGS[config]["model"])
    if start:
        network.load_state_dict(unpack(load_file(start)))
    state = descent.resumed(work, descent.beginning(config, data, network))
    recipe = descent.TrainingRecipe(run.minutes or t["minutes"], descent.cosine(t["rate"], 200, 0.01),
                                    betas=(0.9, 0.98), weight_decay=1e-2, averaging=0.998, workers=0, save_every=180)
    objective = descent.Objective(_TexelSteps(UnfoldedPeople(data["seeds"], work, device), t, run.growing),
                                  lambda batch, step, share: sum(losses(network, batch, device).values()),
                                  lambda average: figures(average, config, unseen, device))
    descent.descend(network, state, objective, recipe, work, device, report)
    return export(work, out)


def prepare(config: str, work: Path, report: Reporter) -> None:
    """Makes the people that the work folder lacks, those held out first."""
    t = CONFIGS[config]["training"]
    named = named_subjects(t["people"], t["held_out"])
    prepare_people(named["held_out_seeds"] + named["seeds"], work, report)


def losses(network: TexelNet, batch: TexelBatch, device: str) -> dict[str, torch.Tensor]:
    """The terms of the loss, each a scalar."""
    low = device == "cuda" or fast_dtype("cpu") == torch.bfloat16
    with torch.autocast(device, torch.bfloat16, enabled=low):
        shading, shadow, spread = network(*(tensor.to(device, memory_format=torch.channels_last)
                                            for tensor in (batch.layers, batch.light)))
    weight = batch.weight.to(device)
    tone, error = split_tone(shading - batch.shading.to(device), weight)
    terms = {"shading": mean_size(error, weight), "tone": TONE * tone.abs().mean(),
             "slope": SLOPE * slope_error(error, weight), "agreement": AGREEMENT * disagreement(error, weight)}
    lost = functional.binary_cross_entropy_with_logits(shadow, batch.shadow.to(device), reduction="none")
    sure = batch.shadow_weight.to(device)
    terms["shadow"] = SHADOW * (lost * sure).sum() / sure.sum().clamp_min(1)
    terms["spread"] = SPREAD * sum(_surprise(band, weight_of, spread[:, k:k + 1]).mean()
                                   for k, (band, weight_of) in enumerate(bands_of(error.detach(), weight)))
    return terms


def bands_of(error: torch.Tensor, weight: torch.Tensor) -> list[tuple[torch.Tensor, torch.Tensor]]:
    """The luminance's part of an error [N, 3, S, S] in each of BANDS, fine to coarse, [N, 1, h, h] of S divided by the
    band's texels, and their weights."""
    luminance, side, bands = error.mean(1, keepdim=True), error.shape[-1], []
    for k, texels in enumerate(BAND_TEXELS):
        here, base = _pooled(luminance, weight, max(1, texels * side // SIDE_TEXELS))
        if k + 1 < len(BAND_TEXELS):
            coarse, _ = _pooled(luminance, weight, max(2, BAND_TEXELS[k + 1] * side // SIDE_TEXELS))
            here = here - functional.interpolate(coarse, size=here.shape[-2:], mode="bilinear", align_corners=False)
        bands.append((here, base))
    return bands


def _pooled(values: torch.Tensor, weight: torch.Tensor, by: int) -> tuple[torch.Tensor, torch.Tensor]:
    base = functional.avg_pool2d(weight, by)
    return functional.avg_pool2d(values * weight, by) / base.clamp_min(1e-3), base


def _surprise(error: torch.Tensor, weight: torch.Tensor, spread: torch.Tensor) -> torch.Tensor:
    """Negative log-likelihood [.] of errors under a Laplace distribution whose log scale is told in maps of any
    size."""
    log = functional.interpolate(spread, size=error.shape[-2:], mode="bilinear", align_corners=False)
    return ((error.abs() * torch.exp(-log) + log) * weight).sum() / weight.sum().clamp_min(1)


@torch.no_grad()
def figures(average: dict, config: str, batch: TexelBatch, device: str) -> dict[str, float]:
    """The averaged network on held-out people: mean error of the log-albedo about its own mean over what was seen,
    beside that of the colours as they are (natural log units); and by band how much better its own sizes of the error
    foretell it than the best constant does (nats)."""
    network = TexelNet(**CONFIGS[config]["model"])
    network.load_state_dict(average)
    network.to(device, memory_format=torch.channels_last).eval()
    outputs = [network(*(tensor.to(device) for tensor in pair))
               for pair in zip(batch.layers.split(4), batch.light.split(4), strict=True)]
    shading, spread = (torch.cat([each[k] for each in outputs]) for k in (0, 2))
    told = {"network": mean_deviation(shading - batch.shading, batch.weight),
            "none": mean_deviation(batch.shading, batch.weight)}
    _, error = split_tone(shading - batch.shading, batch.weight)
    for k, (band, weight) in enumerate(bands_of(error, batch.weight)):
        constant = ((band.abs() * weight).sum() / weight.sum()).clamp_min(1e-6).log()
        told[f"gain_{BAND_TEXELS[k]}"] = (_surprise(band, weight, constant.expand(len(band), 1, 4, 4))
                                    - _surprise(band, weight, spread[:, k:k + 1])).item()
    return {name: round(float(value), 4) for name, value in told.items()}


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights of a training folder as packed safetensors (core/delight/packed.py), with the card that says
    where they come from."""
    state = descent.read_state(work)
    data = state["data"]
    told = ("Synthetic people with brows, beards and hair (core/synthetic/unfolded.py) on heads of the built-in "
            "topology, which derives from the MakeHuman "
            "base mesh (CC0), in the head's own UVs")
    if data["panoramas"]:
        told += f"; light from procedural environments, lamps and {len(data['panoramas'])} panoramas (CC0)"
    what = ("held-out people at half the maps' side: mean error of the log-albedo about its own mean over what was "
            "seen (natural log), beside that of the "
            "colours as they are; gain_N: nats by which its own sizes of the error in bands of N texels foretell it "
            "better than the best constant")
    command = again("texels", state) + (" --hdri hdri" if data["panoramas"] else "")
    ready = sum(person_path(work, seed).is_file() for seed in data["seeds"])
    more = {"panoramas": data["panoramas"], "people": ready, "started": data["started"], "before": data["before"]}
    return release(out, state,
                   TrainingCard(CONFIGS[state["config"]], told, command, {**state["history"][-1][2], "what": what},
                                more), store=pack)


class _TexelSteps(Dataset):
    """`[step]` is the step's batch; mirrored at every other one."""

    def __init__(self, people: UnfoldedPeople, t: dict, growing: bool):
        self.people, self.t, self.growing = people, t, growing

    def __len__(self) -> int:
        return 10**9

    @torch.no_grad()
    def __getitem__(self, step: int) -> TexelBatch:
        if self.growing and step % LOOK_EVERY == 0:
            self.people.look_again()
        rng = np.random.default_rng([self.t["seed"], step])
        fine = step % self.t["fine_every"] == self.t["fine_every"] - 1
        pairs, side = (max(1, self.t["pairs"] // 2), SIDE_TEXELS) if fine else (self.t["pairs"], SIDE_TEXELS // 2)
        batch = self.people.draw(pairs, side, rng)
        return mirrored(batch) if step % 2 else batch


def main(arguments: list[str] | None = None) -> int:
    options = command_line.parser("texels", __doc__, CONFIGS, WEIGHTS)
    command_line.add_sights(options, "people")
    options.add_argument("--start", type=Path, metavar="FILE", help="weights to begin with, in place of random ones")
    return command_line.carry_out(options, arguments, train_texels, export, prepare)


if __name__ == "__main__":
    raise SystemExit(main())
