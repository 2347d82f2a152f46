# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the diffusion prior of facial reflectance on patches of synthetic skins (paper, section 3.4: "Diffusion Prior Training").

    python -m core.training.prior --config cpu --minutes 55 [--resume] [--work DIR]   train, then write the weights and their card
    python -m core.training.prior --export [--work DIR] [--out FILE]                  write the running training's averaged weights now

Needs neither Blender nor the internet. Training can be killed at any time and resumed.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

from ..capture import replacing
from ..messages import Reporter
from ..solve.network import UNet, denoise
from ..solve.prior import WEIGHTS, build, condition, fast_dtype
from .patches import SCALES, Batch, draw, make_skins, mean_map, spread_about

OCTAVES = 6
CONFIGS = {
    "cpu": {
        "model": {"type": "image_v1", "input_channels": 7, "patch_size": 2, "mapping_out": 128, "depths": [1, 2, 2], "channels": [48, 96, 160],
                  "self_attn_depths": [False, False, False], "augment_wrapper": False, "mapping_cond_dim": 4, "norm": "pixel",
                  "sigma_data": 0.5, "sigma_min": 0.01, "sigma_max": 80},
        "cond": {"type": "posenc", "pos_enc_freq": OCTAVES},
        "training": {"patch": 64, "batch": 16, "rate": 5e-4, "skins": 36, "held_out": 4, "seed": 0},
    },
}
SIGMA = {1: (-2.4, 1.2), 2: (-1.8, 1.3), 4: (-1.0, 1.5)}
"""Mean and deviation of ln sigma per scale: the solver sees the coarse maps at high noise and the fine ones at low."""
FIRST_SEED = 1000
"""Training takes the seeds from here on, held-out skins those from HELD_OUT_SEED on; the sample subject's are far below both."""
HELD_OUT_SEED = 9000


def train_prior(config: str, out: Path, minutes: float, report: Reporter, work: Path | None = None, resume: bool = True) -> dict:
    """Trains for `minutes` in all (those of earlier runs included), writes `out` (safetensors, fp16) and its card, returns the card."""
    work = Path(work or Path(tempfile.gettempdir()) / "wildcap_prior")
    work.mkdir(parents=True, exist_ok=True)
    options = CONFIGS[config]
    t = options["training"]
    seeds = list(range(FIRST_SEED, FIRST_SEED + t["skins"]))
    held_out_seeds = list(range(HELD_OUT_SEED, HELD_OUT_SEED + t["held_out"]))
    held_out = draw(make_skins(held_out_seeds, work, report), 96, t["patch"], np.random.default_rng(1), augment=False)
    skins = make_skins(seeds, work, report)
    mean = mean_map(skins)
    statistics = {"mean_face": mean, "spread": spread_about(skins, mean, t["patch"])}
    torch.manual_seed(t["seed"])
    network = build(options)
    optimiser = torch.optim.AdamW(network.parameters(), lr=t["rate"], betas=(0.9, 0.99), weight_decay=1e-3)
    average = {name: value.clone() for name, value in network.state_dict().items()}
    progress = {"config": config, "step": 0, "seconds": 0.0, "seeds": seeds, "held_out_seeds": held_out_seeds, "tones": skins.tones.tolist(), "history": []}
    if resume and (work / "state.pt").is_file():
        saved = torch.load(work / "state.pt", weights_only=True)
        network.load_state_dict(saved["network"])
        optimiser.load_state_dict(saved["optimiser"])
        average, progress = saved["average"], saved["progress"]
    network.to(memory_format=torch.channels_last)
    began, before, saved_at = time.monotonic(), progress["seconds"], 0.0
    while progress["seconds"] < 60 * minutes:
        step, share = progress["step"], progress["seconds"] / (60 * minutes)
        for group in optimiser.param_groups:
            group["lr"] = t["rate"] * min(1.0, (step + 1) / 200) * max(0.02, min(1.0, 2 * (1 - share)))  # constant, then linear to zero over the second half
        rng = np.random.default_rng((t["seed"], step))  # a resumed run draws what an unbroken one would have
        loss = _loss(network, statistics, draw(skins, t["batch"], t["patch"], rng), rng).mean()
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        decay = min(0.9995, (step + 1) / (step + 10))
        for name, value in network.state_dict().items():
            average[name].lerp_(value, 1 - decay)
        progress["step"] += 1
        progress["seconds"] = before + time.monotonic() - began
        report.progress(min(progress["seconds"], 60 * minutes), 60 * minutes, f"step {step + 1}, loss {loss.item():.4f}")
        if progress["seconds"] - saved_at > 120 or progress["seconds"] >= 60 * minutes:
            progress["history"].append([progress["step"], progress["seconds"], *_held_out_loss(average, statistics, options, held_out)])
            report.log(f"step {step + 1}, {progress['seconds'] / 60:.1f} min, held-out loss per scale {progress['history'][-1][2:]}")
            with replacing(work / "state.pt") as temporary:
                torch.save({"network": network.state_dict(), "optimiser": optimiser.state_dict(), "average": average, "progress": progress,
                            "statistics": statistics}, temporary)
            saved_at = progress["seconds"]
    return export(work, out)


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights and the mean face of a training folder as fp16 safetensors, with the card that says where they come from."""
    state = torch.load(Path(work) / "state.pt", weights_only=True)
    progress = state["progress"]
    tensors = {**state["average"], **state["statistics"]}
    with replacing(out) as temporary:
        save_file({name: value.half().contiguous() for name, value in tensors.items()}, temporary)
    options = CONFIGS[progress["config"]]
    history = progress["history"]
    card = {
        **options, "scales": list(SCALES),
        "data": "Procedural skins of core/synthetic on the built-in head, which derives from the MakeHuman base mesh (CC0); no photograph, no scan",
        "licence": "GPL-3.0-or-later",
        "command": f"python -m core train prior --config {progress['config']} --minutes {round(progress['seconds'] / 60)}",
        "steps": progress["step"], "minutes": round(progress["seconds"] / 60, 1), "parameters": sum(v.numel() for n, v in state["average"].items()),
        "seeds": progress["seeds"], "held_out_seeds": progress["held_out_seeds"],
        "held_out": {"loss": dict(zip((f"scale_{scale}" for scale in SCALES), history[-1][2:], strict=True)),
                     "what": "mean squared error of the network's output on fixed patches and noise of the held-out skins; 1 is that of the mean face"},
        "tones": [[round(v, 4) for v in tone] for tone in progress["tones"]],
    }
    with replacing(Path(out).with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(card, indent=1), encoding="utf-8")
    return card


def _loss(network: UNet, statistics: dict[str, torch.Tensor], batch: Batch, rng: np.random.Generator) -> torch.Tensor:
    """EDM's weighted denoising error per sample [N] (Karras et al. 2022, table 1): the squared error of F itself."""
    known = condition(batch.coords, OCTAVES, **statistics, tone=batch.tone)
    mean, deviation = (torch.tensor([SIGMA[int(scale)][i] for scale in batch.scale]) for i in (0, 1))
    sigma = (torch.from_numpy(rng.standard_normal(len(mean))).float() * deviation + mean).exp().clamp(0.005, 80.0)
    noise = torch.from_numpy(rng.standard_normal(batch.clean.shape, dtype=np.float32))
    with torch.autocast("cpu", torch.bfloat16, enabled=fast_dtype("cpu") == torch.bfloat16):
        denoised = denoise(network, batch.clean + sigma[:, None, None, None] * noise, sigma, **known)
    s = sigma[:, None, None, None]
    weight = (s**2 + known["spread"] ** 2) / (s * known["spread"]) ** 2
    return (weight * (denoised - batch.clean) ** 2).mean((1, 2, 3))


@torch.no_grad()
def _held_out_loss(average: dict, statistics: dict, options: dict, batch: Batch) -> list[float]:
    """The averaged network's loss per scale, always on the same patches and noise."""
    network = build(options)
    network.load_state_dict(average)
    losses = _loss(network.to(memory_format=torch.channels_last), statistics, batch, np.random.default_rng(2))
    return [round(losses[batch.scale == scale].mean().item(), 4) for scale in SCALES]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--config", default="cpu", choices=tuple(CONFIGS))
    parser.add_argument("--minutes", type=float, default=55)
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the work folder")
    parser.add_argument("--export", action="store_true", help="write the weights of the work folder's last checkpoint and stop")
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_prior")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    arguments = parser.parse_args()
    if arguments.export:
        export(arguments.work, arguments.out)
        return
    report = Reporter("train", emit=lambda message: print(message.text, flush=True) if type(message).__name__ == "Log" else None)
    train_prior(arguments.config, arguments.out, arguments.minutes, report, arguments.work, arguments.resume)


if __name__ == "__main__":
    main()
