# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Load priors: ours (NAME.safetensors with its card NAME.json), or the authors' config.json and ckpt.pth."""

from __future__ import annotations

import json
from pathlib import Path

import torch
from safetensors import safe_open

from ...capture import shipped_files
from ...capture.messages import Problem
from ...settings.settings import Settings
from ...solver.prior.network import from_state
from ...solver.prior.prior import Prior, ReleasedPrior, build_network, unpack_maps
from . import released

DATA_FILES = ("weights/prior.safetensors", "weights/prior.json")
WEIGHTS = Path(__file__).parents[2] / DATA_FILES[0]


def load(path: Path = WEIGHTS, device: str = "cpu", dtype: torch.dtype | None = None) -> Prior:
    """Load our prior, or the authors' if `path` is a folder with config.json and ckpt.pth. Raises Problem.

    Map-sized work runs in `dtype`, by default bfloat16 if the processor has it.
    """
    path = Path(path)
    if path.suffix != WEIGHTS.suffix:
        prior = _load_released(path)
    else:
        try:
            prior = _load_ours(path)
        except (OSError, KeyError, ValueError, TypeError, RuntimeError) as error:
            raise Problem(
                f"The prior {path} cannot be loaded ({type(error).__name__}: {error}).", "Install the extension again."
            ) from error
    prior.network.lower(dtype or fast_dtype(device))
    return prior.to(device)


def load_chosen(settings: Settings) -> Prior:
    """Load the authors' prior if the settings name one, else ours, on the device of the settings."""
    chosen = settings.solve.prior
    return load(Path(chosen).expanduser() if chosen else WEIGHTS, settings.compute_device)


def fast_dtype(device: str) -> torch.dtype:
    """Return bfloat16 for a GPU or a processor that multiplies it, else float32."""
    if str(device).startswith("cuda"):
        return torch.bfloat16
    return torch.bfloat16 if str(device) == "cpu" and torch.cpu._is_avx512_bf16_supported() else torch.float32


def _load_ours(path: Path) -> Prior:
    shipped_files.require_whole(path)
    card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    with safe_open(path, "pt") as file:
        tensors = {name: file.get_tensor(name).float() for name in file.keys()}
    mean_face, spread = tensors.pop("mean_face"), tensors.pop("spread")
    references = unpack_maps(tensors.pop("references"), tensors.pop("references_range"))
    network = build_network(card)
    network.load_state_dict(tensors)
    return Prior(network, card["cond"]["pos_enc_freq"], mean_face, spread, references)


def _load_released(folder: Path) -> ReleasedPrior:
    config = released.read_config(folder)
    network, state = build_network(config), from_state(released.read_weights(folder))
    try:
        network.load_state_dict(state)
    except RuntimeError as error:
        first = str(error).strip().splitlines()[1:2] or [str(error)]
        raise Problem(
            f"{folder / 'ckpt.pth'} does not fit the config.json beside it ({first[0].strip()}).", released.CHOOSE
        ) from error
    model, cond = config["model"], config["cond"]
    has_sigmas = {"sigma_min", "sigma_max"} <= set(model)
    sigmas = (float(model["sigma_min"]), float(model["sigma_max"])) if has_sigmas else None
    octaves = cond["pos_enc_freq"] if cond["type"] == "posenc" else 0
    return ReleasedPrior(network, cond["type"], octaves, sigmas, released.read_noise(folder))
