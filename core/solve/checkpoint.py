# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler's state on disk: written whole or not at all, and taken up only by a run on the same inputs."""

from __future__ import annotations

import json
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from ..capture import replacing
from .lighting import Lights
from .problem import State


def write(path: Path, state: State, key: str) -> None:
    """Stores a state; `key` stands for everything its future depends on."""
    tensors = {"denoised": state.denoised, "glob": state.lights.glob, "grid": state.lights.grid, "chroma": state.lights.chroma}
    if state.x is not None:
        tensors["x"] = state.x
    tensors |= {f"moment{k}": moment for k, moment in enumerate(state.moments)}
    tensors = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    with replacing(path) as temporary:
        save_file(tensors, temporary, metadata={"key": key, "numbers": json.dumps({"step": state.step})})


def read(path: Path, key: str) -> State | None:
    """The stored state, or None where there is none, it is damaged, or it belongs to another run."""
    try:
        with safe_open(path, "pt") as file:
            metadata = file.metadata() or {}
            if metadata.get("key") != key:
                return None
            tensors: dict[str, torch.Tensor] = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - safe_open is no mapping
        numbers = json.loads(metadata["numbers"])
        moments = [tensors[f"moment{k}"] for k in range(sum(name.startswith("moment") for name in tensors))]
        lights = Lights(tensors["glob"], tensors["grid"], tensors["chroma"])
        return State(numbers["step"], tensors.get("x"), tensors["denoised"], lights, moments)
    except (OSError, SafetensorError, KeyError, ValueError):
        return None
