# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Store the solver's state on the way, for a run on the same inputs, and its solution, for a later solve of a part.

Numbers are stored as tensors: safetensors writes several metadata fields in random order, and the same solve has to
give the same bytes.
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
    """Store a solution, which is of use only under the same `conditions`, mask_edit's."""
    names = "denoised", "painted", "alpha", "gain", "exposure", "local", "tone"
    tensors = {name: getattr(solution, name) for name in names} | vars(solution.lights)
    tensors["settled"] = torch.tensor(solution.settled)
    _save(path, tensors, {FIELD: json.dumps(conditions)})


def read_solution(path: Path, conditions: dict[str, str]) -> Solution | None:
    """Read a solution, or None if there is none, it is damaged, or it was found under other conditions."""
    try:
        tensors, metadata = _read(path)
        if json.loads(metadata.get(FIELD, "null")) != conditions:
            return None
        lights = Lights(*(tensors.pop(name) for name in ("glob", "grid", "chroma")))
        return Solution(lights=lights, settled=bool(tensors.pop("settled")), **tensors)
    except (OSError, SafetensorError, KeyError, TypeError, ValueError):
        return None


def write_state(path: Path, state: State, key: str) -> None:
    """Store a state; `key` stands for everything that its future depends on."""
    tensors = {"denoised": state.denoised, "step": torch.tensor(state.step), **vars(state.lights)}
    if state.x is not None:
        tensors["x"] = state.x
    tensors |= {f"moment{k}": moment for k, moment in enumerate(state.moments)}
    _save(path, tensors, {"key": key})


def read_state(path: Path, key: str) -> State | None:
    """Read a state, or None if there is none, it is damaged, or it belongs to another run."""
    try:
        tensors, metadata = _read(path)
        if metadata.get("key") != key:
            return None
        moments = [tensors[f"moment{k}"] for k in range(sum(name.startswith("moment") for name in tensors))]
        lights = Lights(tensors["glob"], tensors["grid"], tensors["chroma"])
        return State(int(tensors["step"]), tensors.get("x"), tensors["denoised"], lights, moments)
    except (OSError, SafetensorError, KeyError, ValueError):
        return None


def _read(path: Path) -> tuple[dict[str, torch.Tensor], dict[str, str]]:
    """Read the tensors of a file and its metadata."""
    with safe_open(path, "pt") as file:
        return {name: file.get_tensor(name) for name in file.keys()}, file.metadata() or {}


def _save(path: Path, tensors: dict[str, torch.Tensor], metadata: dict[str, str]) -> None:
    """Save tensors. Raises OSError if the file cannot be written."""
    tensors = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    with replacing(path) as temporary:
        try:
            save_file(tensors, temporary, metadata=metadata)
        except SafetensorError as error:
            # it has the system's error in its words alone: "No space left on device (os error 28)"
            code_match = re.search(r"os error (\d+)", str(error))
            number = int(code_match[1]) if code_match else 0
            codes = (0, str(error), str(path), number) if os.name == "nt" else (number, str(error), str(path))
            raise OSError(*codes) from error
