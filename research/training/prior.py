# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the diffusion prior of facial reflectance on patches of skins (paper, section 3.4: "Diffusion Prior
Training").

    python -m research.training prior --config cpu|gpu [--minutes 60] [--skins FOLDER --held-out NAME ...] [--work DIR]
    train, then write weights and card python -m research.training prior --export [--work DIR] [--out FILE]
                     write the running training's averaged weights now

Needs neither Blender nor the internet. A second run goes on where the first was killed. FOLDER is what `train carry`
made of another head's skins; of each --held-out name the whole cluster is kept from training (the same photographs
painted over). Such skins teach the diffuse channels only.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from torch.utils.data import Dataset

from core.capture.messages import Problem, Reporter
from core.solver.prior.network import UNet, denoise
from core.solver.prior.prior import BLIND_SIGMA, build_network, make_condition, pack_maps
from core.stages.solve.prior_files import WEIGHTS, fast_dtype

from . import command_line, descent
from .patches import PatchBatch, Windows, mean_map, reference_skins, spread_about
from .release import TrainingCard, again, release
from .seeds import named_subjects
from .skins import SCALES, Skins, carried_names, carried_skins, clusters, synthetic_skins

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
        "training": {
            "patch": 64,
            "batch": 16,
            "wide_every": 4,
            "rate": 6e-4,
            "minutes": 60,
            "skins": 96,
            "held_out": 6,
            "seed": 0,
            "workers": 0,
        },
    },
    "gpu": {
        "model": {**_MODEL, "depths": [2, 2, 2], "channels": [64, 128, 256]},
        "cond": _COND,
        "training": {
            "patch": 64,
            "batch": 64,
            "wide_every": 4,
            "rate": 4e-4,
            "minutes": 20,
            "skins": 160,
            "held_out": 6,
            "seed": 0,
            "workers": 12,
        },
    },
}
"""`wide_every`: every so many steps the windows are twice as wide and a quarter as many."""
SIGMA = {1: (-2.4, 1.2), 2: (-1.8, 1.3), 4: (-1.0, 1.5)}
"""Mean and deviation of ln sigma per scale: the solver sees the coarse maps at high noise and the fine ones at low."""
BLINDFOLDED = 0.25
"""Share of the whole skins' windows whose normals and specular go in as pure noise, as all of those do that have none:
they must follow from the diffuse, of which more is then to be seen (ln sigma lower by CLEARER)."""
CLEARER = 1.5


def train_prior(
    config: str,
    out: Path,
    report: Reporter,
    run: descent.TrainingRun,
    skins: Path | None = None,
    held_out: list[str] = (),
) -> dict:
    """Trains the solver's prior.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, fp16; its card is written beside it
    report : hears of progress
    run : minutes and the work folder; no light falls on its maps, and it always begins with random weights
    skins : folder of skins that `train carry` brought into our UVs
    held_out : skins of that folder that are kept from training

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where `skins` is no carried folder, or the work folder holds a training on other data
    """
    work, t, device = descent.work_folder(run, "prior"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_data(t, skins, held_out)
    windows, seen, unseen = _windows(data, skins, work, report)
    held_out_windows = {
        kind: Windows(s, real=0.5).draw(96, t["patch"], np.random.default_rng(1))
        for kind, s in unseen.items()
        if s.names
    }
    state = descent.resumed(work, _begin(config, data, seen, windows))
    network = build_network(CONFIGS[config])
    statistics = {name: value.to(device) for name, value in state["statistics"].items()}

    def loss(batch: PatchBatch, step: int, share: float) -> torch.Tensor:
        return _loss(network, statistics, batch, np.random.default_rng((t["seed"], step, 1)), device).mean()

    def figures(average: dict) -> dict:
        return {kind: _held_out_loss(average, statistics, config, b, device) for kind, b in held_out_windows.items()}

    def rate(step: int, share: float) -> float:
        """Constant, then linear to zero over the second half."""
        return t["rate"] * min(1.0, (step + 1) / 200) * max(0.02, min(1.0, 2 * (1 - share)))

    recipe = descent.TrainingRecipe(
        run.minutes or t["minutes"],
        rate,
        betas=(0.9, 0.99),
        weight_decay=1e-3,
        averaging=0.9995,
        workers=t["workers"],
        save_every=120,
    )
    descent.descend(
        network, state, descent.Objective(_PriorSteps(windows, t), loss, figures), recipe, work, device, report
    )
    return export(work, out)


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights, the mean face and the reference skins of a training folder as fp16 safetensors, with the
    card that says where they come from."""
    state = descent.read_state(work)
    data = state["data"]
    levels, limits = pack_maps(state["references"])
    statistics = {name: value.half().contiguous() for name, value in state["statistics"].items()}
    told = "Procedural skins of research/people on the built-in head, which derives from the MakeHuman base mesh (CC0)"
    if data["skins"]:
        told += f"; {len(data['skins'])} skins of {data['from']}, carried into the built-in UVs, diffuse only"
    losses = {
        kind: dict(zip((f"scale_{scale}" for scale in SCALES), of, strict=True))
        for kind, of in state["history"][-1][2].items()
    }
    what = (
        "mean squared error of the network's output on fixed patches and noise of held-out skins; 1 is that of the "
        "mean face"
    )
    card = TrainingCard(
        {**CONFIGS[state["config"]], "scales": list(SCALES)},
        told,
        again("prior", state),
        {"loss": losses, "what": what},
        {"tones": [[round(v, 4) for v in tone] for tone in state["tones"]]},
    )
    return release(out, state, card, {**statistics, "references": levels, "references_range": limits})


def named_data(t: dict, skins: Path | None, held_out: list[str]) -> dict:
    """What is trained on and what is kept from it, by name."""
    data = named_subjects(t["skins"], t["held_out"])
    if skins is None:
        return data
    names = carried_names(skins)
    unknown = sorted(set(held_out) - set(names))
    if unknown:
        raise Problem(f"{skins} holds no skin named {', '.join(unknown)}.", f"Choose from {', '.join(names)}.")
    kept = {name for group in clusters(skins, names) if set(group) & set(held_out) for name in group}
    carried = json.loads((Path(skins) / "carried.json").read_text(encoding="utf-8"))
    return data | {
        "from": carried["from"],
        "notices": carried["notices"],
        "skins": [n for n in names if n not in kept],
        "held_out_skins": sorted(kept),
    }


def _windows(data: dict, folder: Path | None, work: Path, report: Reporter) -> tuple[Windows, Skins, dict[str, Skins]]:
    """What windows are drawn from, the same as skins, and the held-out skins by kind."""
    seen, unseen = (
        synthetic_skins(data["seeds"], work, report),
        {"synthetic": synthetic_skins(data["held_out_seeds"], work, report)},
    )
    if data["skins"]:
        mean = mean_map(seen)
        seen = seen + carried_skins(folder, data["skins"], mean, work, report)
        unseen["carried"] = carried_skins(folder, data["held_out_skins"], mean, work, report)
    return Windows(seen), seen, unseen


def _begin(config: str, data: dict, skins: Skins, windows: Windows) -> dict:
    """The state of a training before its first step."""
    t = CONFIGS[config]["training"]
    torch.manual_seed(t["seed"])
    mean = mean_map(skins)
    return descent.beginning(
        config,
        data,
        build_network(CONFIGS[config]),
        tones=skins.tones.tolist(),
        references=reference_skins(skins),
        statistics={"mean_face": mean, "spread": spread_about(windows, mean, t["patch"])},
    )


class _PriorSteps(Dataset):
    """The batch of each step: it depends on the step alone, so a resumed training draws what an unbroken one would
    have."""

    def __init__(self, windows: Windows, options: dict):
        self.windows, self.options = windows, options

    def __getitem__(self, step: int) -> PatchBatch:
        t = self.options
        wide = 2 if step % t["wide_every"] == 0 else 1
        return self.windows.draw(t["batch"] // wide**2, t["patch"] * wide, np.random.default_rng((t["seed"], step, 0)))


def _loss(
    network: UNet, statistics: dict[str, torch.Tensor], batch: PatchBatch, rng: np.random.Generator, device: str
) -> torch.Tensor:
    """EDM's weighted denoising error per sample [N] (Karras et al. 2022, table 1): the squared error of F itself, where
    the truth is known. What is not known goes in as pure noise."""
    mean, deviation = (torch.tensor([SIGMA[int(scale)][i] for scale in batch.scale]) for i in (0, 1))
    clean, known = batch.clean.to(device), batch.known.to(device)
    blind = torch.from_numpy(rng.random(len(mean)) < BLINDFOLDED).float().to(device)
    mean = mean.to(device) - CLEARER * blind
    blind = torch.maximum(blind, 1 - known[:, 3:].amax((1, 2, 3)))
    sigma = (
        (torch.from_numpy(rng.standard_normal(len(mean))).float() * deviation)
        .to(device)
        .add(mean)
        .exp()
        .clamp(0.005, BLIND_SIGMA)
    )
    noise = torch.from_numpy(rng.standard_normal(batch.clean.shape, dtype=np.float32)).to(device)
    told = make_condition(batch.coords.to(device), OCTAVES, **statistics, tone=batch.tone.to(device), blind=blind)
    s, spread = sigma[:, None, None, None].expand(-1, 7, -1, -1).clone(), told.spread
    s[:, 3:][blind > 0] = BLIND_SIGMA
    noisy = torch.where(known > 0, clean + s * noise, told.mean + (s**2 + spread**2).sqrt() * noise)
    low = device == "cuda" or fast_dtype("cpu") == torch.bfloat16
    with torch.autocast(device, torch.bfloat16, enabled=low):
        denoised = denoise(network, noisy, sigma, told, s)
    weight = known * (s**2 + spread**2) / (s * spread) ** 2
    return (weight * (denoised - clean) ** 2).sum((1, 2, 3)) / known.sum((1, 2, 3)).clamp_min(1)


@torch.no_grad()
def _held_out_loss(average: dict, statistics: dict, config: str, batch: PatchBatch, device: str) -> list[float]:
    """The averaged network's loss per scale, always on the same patches and noise."""
    network = build_network(CONFIGS[config])
    network.load_state_dict(average)
    losses = _loss(
        network.to(device, memory_format=torch.channels_last), statistics, batch, np.random.default_rng(2), device
    ).cpu()
    return [round(losses[batch.scale == scale].mean().item(), 4) for scale in SCALES]


def main(arguments: list[str] | None = None) -> int:
    options = command_line.make_parser("prior", __doc__, CONFIGS, WEIGHTS)
    command_line.add_skins(options)
    return command_line.carry_out(options, arguments, train_prior, export)


if __name__ == "__main__":
    raise SystemExit(main())
