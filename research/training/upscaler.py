# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the network that enlarges the solved maps four times (paper, supplement "Super-Resolution Network").

python -m research.training upscaler --config cpu|gpu|paper
"""

from __future__ import annotations

from functools import partial

import numpy as np
import torch

from core.capture.messages import Reporter
from core.solver.upsampling.network import BICUBIC_ERRORS, Rcan, bicubic
from core.stages.solve.prior_files import fast_dtype

from .descent import Recipe, Run, Task, cosine
from .fine_windows import FineWindows, WindowBatch, prepare
from .networks import Card, Training
from .seeds import named_subjects

_MODEL = {"groups": 5, "blocks": 10, "width": 64}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": dict(patch=48, batch=8, rate=8e-4, minutes=70, skins=32, views=3, held_out=6, seed=0, workers=0),
    },
    "gpu": {
        "model": _MODEL,
        "training": dict(patch=48, batch=32, rate=5e-4, minutes=20, skins=96, views=4, held_out=6, seed=0, workers=12),
    },
    "paper": {
        "model": {"groups": 10, "blocks": 20, "width": 64},
        "training": dict(
            patch=48, batch=16, rate=2e-4, minutes=600, skins=160, views=6, held_out=6, seed=0, workers=12
        ),
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


def prepare_windows(run: Run, options: dict, report: Reporter) -> None:
    """Paint the windows of all subjects."""
    data = named_subjects(options["skins"], options["held_out"])
    prepare(data["seeds"] + data["held_out_seeds"], options["views"], run.work, report, max(2, options["workers"]))


def start(run: Run, options: dict, report: Reporter) -> Task:
    """Open the windows."""
    data = named_subjects(options["skins"], options["held_out"])
    windows, unseen = (FineWindows(data[kind], options["views"], run.work) for kind in ("seeds", "held_out_seeds"))
    held_out = unseen.draw(4 * options["held_out"], options["patch"], np.random.default_rng(1))
    return Task(
        data,
        partial(_draw_step, windows, options),
        lambda network, batch, state, share: loss(network, batch, max(g for g in GROWTH if g[0] <= share)[1]).mean(),
        lambda network, state: measure(network, held_out),
    )


def _draw_step(windows: FineWindows, options: dict, index: int, rng: np.random.Generator) -> list[WindowBatch]:
    return [windows.draw(options["batch"], options["patch"], rng)]


def loss(network: Rcan, batch: WindowBatch, depth: int | None = None) -> torch.Tensor:
    """Return the absolute error per channel [7], in the channels' own units."""
    small, large = (maps.contiguous(memory_format=torch.channels_last) for maps in batch)
    device = small.device
    with torch.autocast(device.type, torch.bfloat16, enabled=fast_dtype(device.type) == torch.bfloat16):
        predicted = network(small, depth)
    error = (predicted.float() - (large - bicubic(small))).abs().mean((0, 2, 3))
    return error / torch.tensor(BICUBIC_ERRORS, device=device)


def measure(network: Rcan, batch: WindowBatch) -> dict[str, float]:
    """Return the mean absolute error by map, as a share of bicubic resampling's."""
    device = next(network.parameters()).device
    parts = [[maps[i : i + 4].to(device) for maps in batch] for i in range(0, len(batch.small), 4)]
    error = sum(loss(network, part).cpu() for part in parts) / len(parts)
    missed = (batch.large - bicubic(batch.small)).abs().mean((0, 2, 3)) / torch.tensor(BICUBIC_ERRORS)
    return {
        name: round(float(error[channels].sum() / missed[channels].sum()), 4)
        for name, channels in (("diffuse", slice(0, 3)), ("normal", slice(3, 6)), ("specular", slice(6, 7)))
    }


def describe(state: dict) -> Card:
    """Return the card's entries, and the weights without the blocks of each group beyond the first KEPT."""
    model = CONFIGS[state["config"]]["model"]
    kept = {
        name: value
        for name, value in state["average"].items()
        if not (name.startswith("groups.") and int(name.split(".")[2]) >= KEPT)
    }
    return Card(
        "Windows of procedural skins of research/people at 4096",
        "mean absolute error on degraded patches of held-out skins, as a share of bicubic resampling's, with all "
        "blocks that were trained",
        config={"model": model | {"blocks": min(KEPT, model["blocks"])}},
        more={"growth": GROWTH},
        weights=kept,
    )


TRAINING = Training(
    "upscaler",
    CONFIGS,
    Recipe(100, cosine(0.01), (0.9, 0.99), weight_decay=1e-4, averaging=0.995, save_every=180),
    lambda config: Rcan(**config["model"]),
    start,
    describe,
    prepare_windows,
)
