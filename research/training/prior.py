# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the diffusion prior of facial reflectance on patches of skins (paper, section 3.4: "Diffusion Prior Training").

    python -m research.training prior --config cpu|gpu [--skins FOLDER --held-out NAME ...]

FOLDER is what `carry` made of another head's skins; of each --held-out name the whole cluster is kept from training
(the same photographs painted over). Such skins teach the diffuse channels only.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import torch

from core.capture.messages import Problem, Reporter
from core.solver.prior.network import UNet, denoise
from core.solver.prior.prior import BLIND_SIGMA, build_network, make_condition, pack_maps
from core.stages.solve.prior_files import fast_dtype

from .descent import Recipe, Run, Task
from .networks import Card, Training
from .patches import PatchBatch, Windows, mean_map, reference_skins, spread_about
from .seeds import named_subjects
from .skins import SCALES, carried_names, carried_skins, clusters, synthetic_skins

OCTAVES = 6
_MODEL = {
    "type": "image_v1",
    "input_channels": 7,
    "patch_size": 2,
    "mapping_out": 128,
    "self_attn_depths": [False, False, False],
    "augment_wrapper": False,
    "mapping_cond_dim": 5,
    "norm": "pixel",
    "sigma_data": 0.5,
    "sigma_min": 0.01,
    "sigma_max": 80,
}
_COND = {"type": "posenc", "pos_enc_freq": OCTAVES}
CONFIGS = {
    "cpu": {
        "model": {**_MODEL, "depths": [1, 2, 2], "channels": [48, 96, 160]},
        "cond": _COND,
        "training": dict(
            patch=64, batch=16, wide_every=4, rate=6e-4, minutes=60, skins=96, held_out=6, seed=0, workers=0
        ),
    },
    "gpu": {
        "model": {**_MODEL, "depths": [2, 2, 2], "channels": [64, 128, 256]},
        "cond": _COND,
        "training": dict(
            patch=64, batch=64, wide_every=4, rate=4e-4, minutes=20, skins=160, held_out=6, seed=0, workers=12
        ),
    },
}
"""`wide_every`: every so many steps the windows are twice as wide and a quarter as many."""
SIGMA = {1: (-2.4, 1.2), 2: (-1.8, 1.3), 4: (-1.0, 1.5)}
"""Mean and deviation of ln sigma per scale: the solver reads the coarse maps at high noise and the fine ones at low."""
BLINDFOLDED = 0.25
"""Share of the whole skins' windows whose normals and specular go in as pure noise, as all of those do that have none:
they must follow from the diffuse, of which more is then to be seen (ln sigma lower by CLEARER)."""
CLEARER = 1.5


def start(run: Run, options: dict, report: Reporter) -> Task:
    """Open the windows, and measure the statistics that the network is built around."""
    data = named_data(options, run.skins, run.held_out)
    skins = synthetic_skins(data["seeds"], run.work, report)
    unseen = {"synthetic": synthetic_skins(data["held_out_seeds"], run.work, report)}
    if data["skins"]:
        mean = mean_map(skins)
        skins += carried_skins(run.skins, data["skins"], mean, run.work, report)
        unseen["carried"] = carried_skins(run.skins, data["held_out_skins"], mean, run.work, report)
    windows, mean, patch = Windows(skins), mean_map(skins), options["patch"]
    held_out = {
        kind: Windows(other, real=0.5).draw(96, patch, np.random.default_rng(1))
        for kind, other in unseen.items()
        if other.names
    }

    def step_loss(network: UNet, batch: PatchBatch, state: dict, share: float) -> torch.Tensor:
        rng = np.random.default_rng((options["seed"], state["step"], 1))
        return loss(network, state["statistics"], batch, rng).mean()

    def measure(network: UNet, state: dict) -> dict:
        return {kind: _measure_scales(network, state["statistics"], batch) for kind, batch in held_out.items()}

    more = {
        "tones": skins.tones.tolist(),
        "references": reference_skins(skins),
        "statistics": {"mean_face": mean, "spread": spread_about(windows, mean, patch)},
    }
    return Task(data, partial(_draw_step, windows, options), step_loss, measure, more)


def describe(state: dict) -> Card:
    """Return the card's entries, and the mean face and the reference skins that go with the weights."""
    levels, limits = pack_maps(state["references"])
    losses = {
        kind: dict(zip((f"scale_{scale}" for scale in SCALES), of, strict=True))
        for kind, of in state["history"][-1][2].items()
    }
    return Card(
        "Procedural skins of research/people",
        "mean squared error of the network's output on fixed patches and noise of held-out skins; 1 is that of the "
        "mean face",
        held_out={"loss": losses},
        skins_use="{}, carried into the built-in UVs, diffuse only",
        config={"scales": list(SCALES)},
        more={"tones": [[round(v, 4) for v in tone] for tone in state["tones"]]},
        tensors={name: value.half().contiguous() for name, value in state["statistics"].items()}
        | {"references": levels, "references_range": limits},
    )


def named_data(options: dict, skins: Path | None, held_out: tuple[str, ...]) -> dict:
    """Name the skins to learn from and the held-out ones. Raises Problem if `skins` has none of a held-out name."""
    data = named_subjects(options["skins"], options["held_out"])
    if skins is None:
        return data
    names = carried_names(skins)
    unknown = sorted(set(held_out) - set(names))
    if unknown:
        raise Problem(f"{skins} holds no skin named {', '.join(unknown)}.", f"Choose from {', '.join(names)}.")
    kept = {name for group in clusters(skins, names) if set(group) & set(held_out) for name in group}
    carried = json.loads((skins / "carried.json").read_text(encoding="utf-8"))
    return data | {
        "from": carried["from"],
        "notices": carried["notices"],
        "skins": [n for n in names if n not in kept],
        "held_out_skins": sorted(kept),
    }


def _draw_step(windows: Windows, options: dict, index: int, rng: np.random.Generator) -> list[PatchBatch]:
    wide = 2 if index % options["wide_every"] == 0 else 1
    return [windows.draw(options["batch"] // wide**2, options["patch"] * wide, rng)]


def loss(
    network: UNet, statistics: dict[str, torch.Tensor], batch: PatchBatch, rng: np.random.Generator
) -> torch.Tensor:
    """Return EDM's weighted denoising error per sample [N] (Karras et al. 2022, table 1).

    It is the squared error of F itself, where the truth is known. The unknown goes in as pure noise.
    """
    device, count = batch.clean.device, len(batch.clean)
    mean, deviation = torch.tensor([SIGMA[int(scale)] for scale in batch.scale], device=device).T
    blind = torch.from_numpy(rng.random(count) < BLINDFOLDED).float().to(device)
    mean = mean - CLEARER * blind
    blind = torch.maximum(blind, 1 - batch.known[:, 3:].amax((1, 2, 3)))
    sigma = torch.from_numpy(rng.standard_normal(count)).float().to(device) * deviation + mean
    sigma = sigma.exp().clamp(0.005, BLIND_SIGMA)
    noise = torch.from_numpy(rng.standard_normal(batch.clean.shape, dtype=np.float32)).to(device)
    statistics = {name: value.to(device) for name, value in statistics.items()}
    condition = make_condition(batch.coords, OCTAVES, **statistics, tone=batch.tone, blind=blind)
    s, spread = sigma[:, None, None, None].expand(-1, 7, -1, -1).clone(), condition.spread
    s[:, 3:][blind > 0] = BLIND_SIGMA
    unknown = condition.mean + (s**2 + spread**2).sqrt() * noise
    noisy = torch.where(batch.known > 0, batch.clean + s * noise, unknown)
    with torch.autocast(device.type, torch.bfloat16, enabled=fast_dtype(device.type) == torch.bfloat16):
        denoised = denoise(network, noisy, sigma, condition, s)
    weight = batch.known * (s**2 + spread**2) / (s * spread) ** 2
    return (weight * (denoised - batch.clean) ** 2).sum((1, 2, 3)) / batch.known.sum((1, 2, 3)).clamp_min(1)


def _measure_scales(network: UNet, statistics: dict, batch: PatchBatch) -> list[float]:
    """Return the loss per scale, always on the same patches and noise."""
    device = next(network.parameters()).device
    losses = loss(network, statistics, batch._make(part.to(device) for part in batch), np.random.default_rng(2)).cpu()
    return [round(losses[batch.scale == scale].mean().item(), 4) for scale in SCALES]


TRAINING = Training(
    "prior",
    CONFIGS,
    # the rate falls linearly to zero over the second half
    Recipe(
        200,
        lambda share: max(0.02, min(1.0, 2 * (1 - share))),
        (0.9, 0.99),
        weight_decay=1e-3,
        averaging=0.9995,
        save_every=120,
    ),
    build_network,
    start,
    describe,
    options=("skins", "held-out"),
)
