# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the delighting network on synthetic people and portraits whose light is known.

    python -m research.training delighter --config cpu|gpu [--hdri FOLDER] [--skins FOLDER --held-out NAME ...]
    [--start FILE]

FOLDERs: panoramas (.hdr, .exr) that may light portraits, and skins that `carry` brought into our UVs; without them all
light and skin is procedural.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch.nn import functional

from core.capture.messages import Reporter
from core.stages.delight.unet import DelightNet
from core.stages.solve.prior_files import fast_dtype

from ..people.environments import read_panoramas
from . import people, portraits
from .descent import Recipe, Run, Task, cosine
from .networks import Card, Training
from .portraits import PortraitBatch, mirrored, repainted
from .prior import named_data
from .seeds import panorama_names, training_seeds
from .shading_errors import disagreement, mean_deviation, mean_size, slope_error, split_tone
from .sights import SightStore, Source, stack_examples

_MODEL = {"widths": [64, 128, 192, 224], "depths": [2, 2, 2, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": dict(
            pairs=2, echo=2, rate=4e-4, minutes=180, skins=48, people=120, views=8, held_out=6, seed=0, workers=1
        ),
    },
    "gpu": {
        "model": _MODEL,
        "training": dict(
            pairs=16, echo=1, rate=1.0e-3, minutes=24, skins=160, people=360, views=8, held_out=6, seed=0, workers=14
        ),
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


def prepare(run: Run, options: dict, report: Reporter) -> None:
    """Make the sights of people and of bald subjects, those of the held-out ones first."""
    data, (subjects, figures) = open_data(run, options)
    processes = options["workers"] + 1
    figures.store.prepare(data["held_out_seeds"] + figures.seeds, people.make_sights, report, processes)
    subjects.store.prepare(data["held_out_seeds"], portraits.make_sights, report, processes)
    in_skins = partial(portraits.make_sights, skins=run.skins, names=data["skins"])
    subjects.store.prepare(subjects.seeds, in_skins, report, processes)


def open_data(run: Run, options: dict) -> tuple[dict, tuple[Source, Source]]:
    """Return the names of the data, and its sources: bald subjects and people."""
    data = named_data(options, run.skins, run.held_out) | {
        "panoramas": panorama_names(run.hdri),
        "people": training_seeds(options["people"]),
        "started": "the weights before" if run.start else SCRATCH,
    }
    panoramas = read_panoramas(run.hdri)
    subjects, figures = (SightStore(run.work, kind, options["views"]) for kind in ("subject", "person"))
    return data, (
        Source(subjects, data["seeds"], portraits.shoot, panoramas),
        Source(figures, data["people"], people.shoot, panoramas),
    )


def start(run: Run, options: dict, report: Reporter) -> Task:
    """Open the data."""
    data, sources = open_data(run, options)
    held_out = {}
    for kind, source in zip(("", "people_"), sources, strict=True):
        unseen = replace(source, seeds=data["held_out_seeds"])
        examples = unseen.draw(4 * options["held_out"], np.random.default_rng(1), augment=False)
        held_out[kind] = stack_examples(PortraitBatch, examples)
    return Task(
        data,
        partial(_draw_step, *sources, options),
        lambda network, batch, state, share: sum(losses(network, batch).values()),
        lambda network, state: {
            kind + name: value for kind, batch in held_out.items() for name, value in measure(network, batch).items()
        },
    )


def _draw_step(
    subjects: Source, figures: Source, options: dict, index: int, rng: np.random.Generator
) -> list[PortraitBatch]:
    """Draw a batch from one source, and return it for each step of an echo: as it is, or mirrored and repainted."""
    source, echo = figures if rng.random() < PEOPLE else subjects, options["echo"]
    batch, steps = stack_examples(PortraitBatch, source.draw(options["pairs"], rng)), []
    for step in range(index * echo, (index + 1) * echo):
        turned = step % 2 if echo > 1 else rng.random() < 0.5
        paint_rng = np.random.default_rng((options["seed"], index, step))
        steps.append(mirrored(repainted(batch, paint_rng)) if turned else batch)
    return steps


def losses(network: DelightNet, batch: PortraitBatch) -> dict[str, torch.Tensor]:
    """Return the terms of the loss, each a scalar."""
    shading, shadow = _predict(network, batch.layers)
    tone, error = split_tone(shading - batch.shading, batch.weight)
    unsure = functional.binary_cross_entropy_with_logits(shadow, batch.shadow, reduction="none")
    return {
        "shading": mean_size(error, batch.weight),
        "tone": TONE * tone.abs().mean(),
        "slope": SLOPE * slope_error(error, batch.weight),
        "agreement": AGREEMENT * disagreement(error, batch.weight),
        "shadow": SHADOW * (unsure * batch.shadow_weight).sum() / batch.shadow_weight.sum().clamp_min(1),
    }


def _predict(network: DelightNet, layers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    device = layers.device.type
    with torch.autocast(device, torch.bfloat16, enabled=fast_dtype(device) == torch.bfloat16):
        return network(layers.contiguous(memory_format=torch.channels_last))


def measure(network: DelightNet, batch: PortraitBatch) -> dict[str, float]:
    """Measure the network on those held-out portraits whose geometry is known.

    geometry, picture (without geometry), none (the picture as it is): mean absolute error of the log-albedo about its
    own mean over the skin, natural log; iou_geometry, iou_picture: intersection over union of the shadows.
    """
    device = next(network.parameters()).device
    batch = batch._make(part[batch.layers[:, 15].amax((1, 2)) > 0] for part in batch)
    bare = torch.cat([batch.layers[:, :6], 0 * batch.layers[:, 6:]], 1)
    figures = {}
    for name, layers in (("geometry", batch.layers), ("picture", bare)):
        answers = [_predict(network, rows.to(device)) for rows in layers.split(8)]
        shading, shadow = (torch.cat([answer[k].cpu() for answer in answers]) for k in (0, 1))
        figures[name] = mean_deviation(shading - batch.shading, batch.weight)
        predicted, true, sure = shadow > 0, batch.shadow > 0.5, batch.shadow_weight > 0.9
        union = ((predicted | true) & sure).sum().clamp_min(1)
        figures[f"iou_{name}"] = ((predicted & true & sure).sum() / union).item()
    figures["none"] = mean_deviation(batch.shading, batch.weight)
    return {name: round(float(value), 4) for name, value in figures.items()}


def describe(state: dict) -> Card:
    data = state["data"]
    return Card(
        "Synthetic people with hair, beards and open eyes (research/people/lifelike) and portraits of bald subjects "
        "(research/people)",
        "portraits of held-out subjects, and people_ of held-out people: mean error of the log-albedo about its own "
        "mean over the skin (natural log), told the geometry or the picture only, beside the picture as it is; "
        "intersection over union of the shadows",
        skins_use="some wear one of {}, carried into the built-in UVs",
        started="" if data["started"] == SCRATCH else " --start delighter.safetensors",
        more={name: data[name] for name in ("panoramas", "people", "started")},
    )


TRAINING = Training(
    "delighter",
    CONFIGS,
    Recipe(200, cosine(0.01), (0.9, 0.98), weight_decay=1e-2, averaging=0.998, save_every=600),
    lambda config: DelightNet(**config["model"]),
    start,
    describe,
    prepare,
    ("hdri", "skins", "held-out", "start"),
)
