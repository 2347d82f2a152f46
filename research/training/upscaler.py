# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the network that enlarges the solved maps four times (paper, supplement "Super-Resolution Network").

    python -m research.training upscaler --config cpu|gpu|paper [--minutes 70] [--work DIR]
    python -m research.training upscaler --export [--work DIR] [--out FILE]      write the running training's averaged
    weights now

Needs neither Blender nor the internet. A second run goes on where the first was killed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch.utils.data import Dataset

from core.capture.messages import Reporter
from core.solver.upsampling.network import BICUBIC_ERRORS, Rcan, bicubic
from core.stages.solve.prior_files import fast_dtype
from core.stages.upscale.enlarge import WEIGHTS

from . import command_line, descent
from .fine_windows import FineWindows, prepare
from .release import TrainingCard, again, release
from .seeds import named_subjects

_MODEL = {"groups": 5, "blocks": 10, "width": 64}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": {
            "patch": 48,
            "batch": 8,
            "rate": 8e-4,
            "minutes": 70,
            "skins": 32,
            "views": 3,
            "held_out": 6,
            "seed": 0,
            "workers": 0,
        },
    },
    "gpu": {
        "model": _MODEL,
        "training": {
            "patch": 48,
            "batch": 32,
            "rate": 5e-4,
            "minutes": 20,
            "skins": 96,
            "views": 4,
            "held_out": 6,
            "seed": 0,
            "workers": 12,
        },
    },
    "paper": {
        "model": {"groups": 10, "blocks": 20, "width": 64},
        "training": {
            "patch": 48,
            "batch": 16,
            "rate": 2e-4,
            "minutes": 600,
            "skins": 160,
            "views": 6,
            "held_out": 6,
            "seed": 0,
            "workers": 12,
        },
    },
}
"""`views` windows of each of `skins` subjects. `paper` has the size of the paper's network; nothing of ours was trained
with it."""
GROWTH = ((0.0, 2), (0.3, 5), (0.6, None))
"""From which share of the time on how many blocks of each group take part: a shallow network learns most of what there
is at a fraction of the cost, and new blocks begin as the identity (progressive stacking, Gong et al. 2019)."""

KEPT = 3
"""Blocks of each group that are shipped: the first two learn first, and those that were added as the identity change
little."""


def train_upscaler(config: str, out: Path, report: Reporter, run: descent.TrainingRun) -> dict:
    """Trains the upscaler; preparation does not count into its minutes.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, fp16; its card is written beside it
    report : hears of progress
    run : minutes and the work folder; no light falls on its maps, and it always begins with random weights

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where the work folder holds a training of another configuration
    """
    work, t, device = descent.work_folder(run, "upscaler"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_subjects(t["skins"], t["held_out"])
    for seeds in (data["seeds"], data["held_out_seeds"]):
        prepare(seeds, t["views"], work, report, max(2, t["workers"]))
    held_out = FineWindows(data["held_out_seeds"], t["views"], work).draw(
        4 * t["held_out"], t["patch"], np.random.default_rng(1)
    )
    torch.manual_seed(t["seed"])
    network = Rcan(**CONFIGS[config]["model"])
    state = descent.resumed(work, descent.beginning(config, data, network))

    def loss(batch, step, share):
        return _error(network, batch, device, max(growth for growth in GROWTH if growth[0] <= share)[1]).mean()

    recipe = descent.TrainingRecipe(
        run.minutes or t["minutes"],
        descent.cosine(t["rate"], 100, 0.01),
        betas=(0.9, 0.99),
        weight_decay=1e-4,
        averaging=0.995,
        workers=t["workers"],
        save_every=180,
    )
    objective = descent.Objective(
        _UpscalerSteps(FineWindows(data["seeds"], t["views"], work), t),
        loss,
        lambda average: measure_figures(average, config, held_out, device),
    )
    descent.descend(network, state, objective, recipe, work, device, report)
    return export(work, out)


def _error(network: Rcan, pairs: tuple[torch.Tensor, torch.Tensor], device: str, depth: int | None) -> torch.Tensor:
    """Absolute error per channel [7], in the channels' own units."""
    small, large = (x.to(device, memory_format=torch.channels_last) for x in pairs)
    missing = large - bicubic(small)
    with torch.autocast(device, torch.bfloat16, enabled=device == "cuda" or fast_dtype("cpu") == torch.bfloat16):
        predicted = network(small, depth)
    return (predicted.float() - missing).abs().mean((0, 2, 3)) / torch.tensor(BICUBIC_ERRORS, device=device)


@torch.no_grad()
def measure_figures(
    average: dict, config: str, pairs: tuple[torch.Tensor, torch.Tensor], device: str
) -> dict[str, float]:
    """The averaged network on held-out patches.

    Parameters
    ----------
    average : its weights
    config : one of CONFIGS
    pairs : small [N, 7, P, P] and large [N, 7, 4 P, 4 P], in the network's channels
    device : on which it runs

    Returns
    -------
    diffuse, normal, specular: mean absolute error as a share of bicubic resampling's.
    """
    network = Rcan(**CONFIGS[config]["model"]).to(device, memory_format=torch.channels_last)
    network.load_state_dict(average)
    parts = [tuple(x[i : i + 4] for x in pairs) for i in range(0, len(pairs[0]), 4)]
    error = sum(_error(network, chunk, device, None).cpu() for chunk in parts) / len(parts)
    missed = (pairs[1] - bicubic(pairs[0])).abs().mean((0, 2, 3)) / torch.tensor(BICUBIC_ERRORS)
    return {
        name: round(float(error[channels].sum() / missed[channels].sum()), 4)
        for name, channels in (("diffuse", slice(0, 3)), ("normal", slice(3, 6)), ("specular", slice(6, 7)))
    }


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights of a training folder as fp16 safetensors, with the card that says where they come from."""
    state = descent.read_state(work)
    config = CONFIGS[state["config"]]
    state, config = (
        state | {"average": shallow(state["average"], KEPT)},
        config | {"model": config["model"] | {"blocks": min(KEPT, config["model"]["blocks"])}},
    )
    told = (
        "Windows of procedural skins of research/people at 4096 on the built-in head, which derives from the "
        "MakeHuman base mesh (CC0)"
    )
    what = (
        "mean absolute error on degraded patches of held-out skins, as a share of bicubic resampling's, with all "
        "blocks that were trained"
    )
    return release(
        out,
        state,
        TrainingCard(
            config, told, again("upscaler", state), {**state["history"][-1][2], "what": what}, {"growth": GROWTH}
        ),
    )


def shallow(weights: dict[str, torch.Tensor], blocks: int) -> dict[str, torch.Tensor]:
    """A network's weights without the blocks of each group beyond the first `blocks`."""
    return {
        name: value
        for name, value in weights.items()
        if not (name.startswith("groups.") and int(name.split(".")[2]) >= blocks)
    }


class _UpscalerSteps(Dataset):
    """The batch of each step, which depends on the step alone."""

    def __init__(self, windows: FineWindows, options: dict):
        self.windows, self.options = windows, options

    def __getitem__(self, step: int) -> tuple[torch.Tensor, torch.Tensor]:
        return self.windows.draw(
            self.options["batch"], self.options["patch"], np.random.default_rng((self.options["seed"], step))
        )


def main(arguments: list[str] | None = None) -> int:
    options = command_line.make_parser("upscaler", __doc__, CONFIGS, WEIGHTS)
    return command_line.carry_out(options, arguments, train_upscaler, export)
