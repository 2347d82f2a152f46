# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the delighting network on people whose light is known: synthetic ones, and photographs of real ones, relit.

    python -m research.training delighter --config cpu|gpu --photographs LONDON [--hdri FOLDER]
    [--skins FOLDER --held-out NAME ...] [--start FILE]

LONDON is the folder london_faces. FOLDERs: panoramas (.hdr, .exr) that may light portraits, and skins that `carry`
brought into our UVs; without them all light and skin is procedural.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch.nn import functional

from core.capture.messages import Reporter
from core.stages.delight.unet import DelightNet, slice_grid
from core.stages.solve.prior_files import fast_dtype

from ..people import london
from ..people.environments import read_panoramas
from . import people, portraits, real_people
from .descent import Recipe, Run, Task
from .networks import Card, Training
from .portraits import PortraitBatch, mirrored, repainted
from .prior import named_data
from .seeds import panorama_names, training_seeds
from .shading_errors import mean_deviation, mean_size, quantile_error, slope_error, split_tone, without_coarse
from .sights import SightStore, Source, stack_examples

_MODEL = {"widths": [64, 128, 192, 224], "depths": [2, 2, 2, 2], "bins": 5, "answers": 5}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": dict(
            pairs=4, echo=2, rate=2.5e-4, minutes=1200, skins=48, people=60, views=8, held_out=6, seed=0, workers=1
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
SHARES = {"real": 0.34, "person": 0.48, "subject": 0.18}
"""Of the sights: real people, synthetic people with hair and open eyes, bald subjects."""
FINE_PX = 10.0
"""Deviation of the blur that parts what is known of real people from what is not: half an eighth of a face."""
TONE, SLOPE, AGREEMENT, SHADOW, SIZE = 0.25, 1.0, 0.25, 0.3, 0.1
"""Weights beside the log-shading's error: its mean over the face, its slopes, the albedo of one face under two lights,
the shadows, the size of the error."""
WITHIN = 0.68
"""Share of the errors that lie within the size that the network states, as within a standard deviation."""
LEAST_ERROR, USUAL_ERROR = 0.01, 0.15  # natural log; the logarithm of a smaller one is not learnt


def prepare(run: Run, options: dict, report: Reporter) -> None:
    """Make the sights of real people, of synthetic ones and of bald subjects, those of the held-out ones first."""
    data, sources = open_data(run, options)
    processes = options["workers"] + 1
    if run.photographs:
        real_people.prepare(sources["real"].store, run.photographs, report, processes)
    subjects = sources["subject"]
    subjects.store.prepare(data["held_out_seeds"], portraits.make_sights, report, processes)
    in_skins = partial(portraits.make_sights, skins=run.skins, names=data["skins"])
    subjects.store.prepare(subjects.seeds, in_skins, report, processes)
    figures = sources["person"]
    figures.store.prepare(data["held_out_seeds"] + figures.seeds, people.make_sights, report, processes)


def open_data(run: Run, options: dict) -> tuple[dict, dict[str, Source]]:
    """Return the names of the data, and its sources by the name of their share."""
    real = [int(path.name[:3]) for path in london.photographs(run.photographs)] if run.photographs else []
    data = named_data(options, run.skins, run.held_out) | {
        "panoramas": panorama_names(run.hdri),
        "people": training_seeds(options["people"]),
        "real": real,
        "started": "the weights before" if run.start else SCRATCH,
    }
    panoramas, views = read_panoramas(run.hdri), options["views"]
    kinds = {"subject": (data["seeds"], portraits), "person": (data["people"], people), "real": (real, real_people)}
    return data, {
        kind: Source(SightStore(run.work, kind, views), seeds, module.shoot, panoramas)
        for kind, (seeds, module) in kinds.items()
        if seeds
    }


def start(run: Run, options: dict, report: Reporter) -> Task:
    """Open the data."""
    data, sources = open_data(run, options)
    held_out = {}
    for kind in ("subject", "person"):
        unseen = replace(sources[kind], seeds=data["held_out_seeds"])
        examples = unseen.draw(4 * options["held_out"], np.random.default_rng(1), augment=False)
        held_out[kind] = stack_examples(PortraitBatch, examples)
    return Task(
        data,
        partial(_draw_step, sources, options),
        lambda network, batch, state, share: sum(losses(network, batch).values()),
        lambda network, state: {
            f"{kind}_{name}": value
            for kind, batch in held_out.items()
            for name, value in measure(network, batch).items()
        },
    )


def _draw_step(sources: dict[str, Source], options: dict, index: int, rng: np.random.Generator) -> list[PortraitBatch]:
    """Draw a batch, each sight from any source, and return it for each step of an echo.

    As it is, or mirrored and repainted.
    """
    shares, echo = np.array([SHARES[kind] for kind in sources]), options["echo"]
    kinds = rng.choice(list(sources), options["pairs"], p=shares / shares.sum())
    batch = stack_examples(PortraitBatch, [example for kind in kinds for example in sources[kind].draw(1, rng)])
    steps = []
    for step in range(index * echo, (index + 1) * echo):
        turned = step % 2 if echo > 1 else rng.random() < 0.5
        paint_rng = np.random.default_rng((options["seed"], index, step))
        steps.append(mirrored(repainted(batch, paint_rng)) if turned else batch)
    return steps


def losses(network: DelightNet, batch: PortraitBatch) -> dict[str, torch.Tensor]:
    """Return the terms of the loss, each a scalar.

    Of real people the studio's light is not quite known: what two lights on one sight have in common counts only as far
    as it is finer than an eighth of the face, and their difference at all scales.
    """
    shading, shadow, size = _predict(network, batch.layers)
    both, real = batch.weight[0::2] * batch.weight[1::2], batch.real > 0.5
    weight = torch.where(real, both.repeat_interleave(2, 0), batch.weight)
    tone, error = split_tone(shading - batch.shading, weight)
    common, change = (error[0::2] + error[1::2]) / 2, (error[0::2] - error[1::2]) / 2
    fine = without_coarse(common, both, FINE_PX)
    certain = torch.where(real, torch.stack([fine + change, fine - change], 1).flatten(0, 1), error)
    unsure = functional.binary_cross_entropy_with_logits(shadow, batch.shadow, reduction="none")
    return {
        "shading": mean_size(certain, weight),
        "tone": TONE * (tone.abs() * ~real).mean(),
        "slope": SLOPE * slope_error(error, weight),
        "agreement": AGREEMENT * mean_size(2 * change, both),
        "shadow": SHADOW * (unsure * batch.shadow_weight).sum() / batch.shadow_weight.sum().clamp_min(1),
        "size": SIZE * quantile_error(error.detach().mean(1, keepdim=True), size, weight * ~real, WITHIN, LEAST_ERROR),
    }


def _predict(network: DelightNet, layers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return log-shading [N, 3, S, S] less the picture's middle, shadow logits and log-size of errors [N, 1, S, S]."""
    device = layers.device.type
    with torch.autocast(device, torch.bfloat16, enabled=fast_dtype(device) == torch.bfloat16):
        grid = network(layers.contiguous(memory_format=torch.channels_last))
    answer = slice_grid(grid.float(), layers[:, 3:6])
    return answer[:, :3], answer[:, 3:4], answer[:, 4:]


def load_start(network: DelightNet, weights: dict[str, torch.Tensor]) -> None:
    """Load weights; those of a network without bins say the same in all of them, and nothing of its errors."""
    for name in ("out.weight", "out.bias"):
        if len(weights[name]) == 4:
            weights[name] = weights[name].repeat_interleave(network.bins, 0)
        missing = len(network.out.bias) - len(weights[name])
        usual = float(np.log(USUAL_ERROR)) if name == "out.bias" else 0.0
        weights[name] = torch.cat([weights[name], torch.full((missing, *weights[name].shape[1:]), usual)])
    network.load_state_dict(weights)


def measure(network: DelightNet, batch: PortraitBatch) -> dict[str, float]:
    """Measure the network on those held-out portraits whose geometry is known.

    geometry, picture (without geometry), none (the picture as it is): mean absolute error of the log-albedo about its
    own mean over the skin, natural log; iou_geometry, iou_picture: intersection over union of the shadows;
    within_geometry, within_picture: share of the errors within the size that the network states.
    """
    device = next(network.parameters()).device
    batch = batch._make(part[batch.layers[:, 15].amax((1, 2)) > 0] for part in batch)
    bare = torch.cat([batch.layers[:, :6], 0 * batch.layers[:, 6:]], 1)
    figures = {}
    for name, layers in (("geometry", batch.layers), ("picture", bare)):
        answers = [_predict(network, rows.to(device)) for rows in layers.split(8)]
        shading, shadow, size = (torch.cat([answer[k].cpu() for answer in answers]) for k in (0, 1, 2))
        figures[name] = mean_deviation(shading - batch.shading, batch.weight)
        _, error = split_tone(shading - batch.shading, batch.weight)
        within = (error.mean(1, keepdim=True).abs() < size.exp()) * batch.weight
        figures[f"within_{name}"] = (within.sum() / batch.weight.sum()).item()
        predicted, true, sure = shadow > 0, batch.shadow > 0.5, batch.shadow_weight > 0.9
        union = ((predicted | true) & sure).sum().clamp_min(1)
        figures[f"iou_{name}"] = ((predicted & true & sure).sum() / union).item()
    figures["none"] = mean_deviation(batch.shading, batch.weight)
    return {name: round(float(value), 4) for name, value in figures.items()}


def describe(state: dict) -> Card:
    data = state["data"]
    return Card(
        "Synthetic people with hair, beards and open eyes (research/people/lifelike), portraits of bald subjects "
        f"(research/people), and photographs of {len(data['real'])} real people, relit ({london.ATTRIBUTION}),",
        "subject_ of held-out bald subjects, and person_ of held-out people: mean error of the log-albedo about its "
        "own mean over the face (natural log), told the geometry or the picture only, beside the picture as it is; "
        "intersection over union of the shadows; share of the errors within the size that the network states",
        skins_use="some wear one of {}, carried into the built-in UVs",
        started="" if data["started"] == SCRATCH else " --start delighter.safetensors",
        more={name: data[name] for name in ("panoramas", "people", "real", "started")},
    )


TRAINING = Training(
    "delighter",
    CONFIGS,
    Recipe(300, lambda share: 1.0, (0.9, 0.98), weight_decay=1e-2, averaging=0.999, save_every=600),
    lambda config: DelightNet(**config["model"]),
    start,
    describe,
    prepare,
    ("hdri", "skins", "held-out", "photographs", "start"),
    load_start,
)
