# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver keeps on disk: its state on the way, taken up only by a run on the same inputs, and what it found in
the end, for a later solve of a part.

Numbers are stored as tensors: safetensors writes several metadata fields in random order, and the same solve is to give
the same bytes.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from ...capture.files import replacing
from ...capture.mask_edit import FIELD
from ...solver.lighting import Lights
from ...solver.objective import State
from ...solver.solution import Solution


def write_solution(path: Path, solution: Solution, conditions: dict[str, str]) -> None:
    """`conditions` are mask_edit's: under others this state is of no use."""
    lights = {"glob": solution.lights.glob, "grid": solution.lights.grid, "chroma": solution.lights.chroma}
    names = "denoised", "painted", "alpha", "gain", "local", "tone"
    tensors = {name: getattr(solution, name) for name in names} | lights
    tensors["settled"] = torch.tensor(solution.settled)
    tensors["exposure"] = torch.tensor(solution.exposure, dtype=torch.float64)
    tensors = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    _save(path, tensors, {FIELD: json.dumps(conditions)})


def read_solution(path: Path, conditions: dict[str, str]) -> Solution | None:
    """None where there is none, it is damaged, or it was found under other conditions."""
    try:
        with safe_open(path, "pt") as file:
            metadata = file.metadata() or {}
            if json.loads(metadata.get(FIELD, "null")) != conditions:
                return None
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - safe_open is no mapping
        lights = Lights(*(tensors.pop(name) for name in ("glob", "grid", "chroma")))
        return Solution(
            lights=lights,
            exposure=tensors.pop("exposure").item(),
            settled=bool(tensors.pop("settled")),
            **tensors,
        )
    except (OSError, SafetensorError, KeyError, TypeError, ValueError):
        return None


def write_state(path: Path, state: State, key: str) -> None:
    """Stores a state; `key` stands for everything its future depends on."""
    tensors = {
        "denoised": state.denoised,
        "glob": state.lights.glob,
        "grid": state.lights.grid,
        "chroma": state.lights.chroma,
    }
    if state.x is not None:
        tensors["x"] = state.x
    tensors["step"] = torch.tensor(state.step)
    tensors |= {f"moment{k}": moment for k, moment in enumerate(state.moments)}
    tensors = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    _save(path, tensors, {"key": key})


def read_state(path: Path, key: str) -> State | None:
    """The stored state, or None where there is none, it is damaged, or it belongs to another run."""
    try:
        with safe_open(path, "pt") as file:
            metadata = file.metadata() or {}
            if metadata.get("key") != key:
                return None
            tensors: dict[str, torch.Tensor] = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - safe_open is no mapping
        moments = [tensors[f"moment{k}"] for k in range(sum(name.startswith("moment") for name in tensors))]
        lights = Lights(tensors["glob"], tensors["grid"], tensors["chroma"])
        return State(int(tensors["step"]), tensors.get("x"), tensors["denoised"], lights, moments)
    except (OSError, SafetensorError, KeyError, ValueError):
        return None


def _save(path: Path, tensors: dict[str, torch.Tensor], metadata: dict[str, str]) -> None:
    """Raises Problem where it cannot be written."""
    with replacing(path) as temporary:
        try:
            save_file(tensors, temporary, metadata=metadata)
        except SafetensorError as error:
            # which tells the system's error in words alone: "No space left on device (os error 28)"
            code_match = re.search(r"os error (\d+)", str(error))
            number = int(code_match[1]) if code_match else 0
            raise (
                OSError(0, str(error), str(path), number) if os.name == "nt" else OSError(number, str(error), str(path))
            ) from error
