# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of OpenDelight as its authors publish them, read as weights only and checked tensor by tensor: nothing in
them is ever run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from ..contract.messages import Problem
from .opendelight_network import HEAD_WIDTH, base_shapes, enhancer_shapes

BASE, ENHANCER = "base_delight_network.pth", "unet_enhancer.pth"
CHOOSE = (
    f"Choose the folder with {BASE} and {ENHANCER}, as the authors of OpenDelight publish them, or another delighter."
)


@dataclass(frozen=True)
class Checkpoint:
    """State dicts (name -> float32 tensor) of the network and of the one that gives detail back, None where its file
    does not lie beside the first."""

    base: dict[str, Tensor]
    enhancer: dict[str, Tensor] | None


def load(path: str, device: str = "cpu") -> Checkpoint:
    """The checkpoint in a folder, or the first network's file. Raises Problem for anything else."""
    if not path:
        raise Problem("No checkpoint of OpenDelight was chosen.", CHOOSE)
    chosen = Path(path)
    base = chosen / BASE if chosen.is_dir() else chosen
    if not base.is_file():
        raise Problem(f"There is no OpenDelight checkpoint at {base}.", CHOOSE)
    enhancer = base.with_name(ENHANCER)
    return Checkpoint(
        _read(base, base_shapes, _fits_the_crop, device),
        _read(enhancer, enhancer_shapes, lambda state: "", device) if enhancer.is_file() else None,
    )


def _read(path: Path, shapes: Callable, fault: Callable[[dict], str], device: str) -> dict[str, Tensor]:
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # a damaged or hostile file can make the reader fail in any way
        raise Problem(
            f"{path} cannot be read as weights: it is damaged, or holds more than weights "
            f"({type(error).__name__}). Nothing in it was run.",
            "Download it again from the page of OpenDelight's authors.",
        ) from error
    try:
        wanted = shapes(state)
        wrong = [f"{name} is missing" for name in wanted if name not in state] + [
            f"{name} is not part of it" for name in state if name not in wanted
        ]
        wrong += [
            f"{name} is {_size(state[name].shape)}, not {_size(shape)}"
            for name, shape in wanted.items()
            if name in state and state[name].shape != shape
        ]
        wrong += [defect] if (defect := fault(state)) else []
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        what = error.args[0] if isinstance(error, KeyError) else "its first tensors"
        wrong = [f"{what} is missing or of another kind"]
    if wrong:
        more = f" ({len(wrong) - 1} more such faults)" if wrong[1:] else ""
        raise Problem(f"{path} is not the OpenDelight network that is expected here: {wrong[0]}{more}.", CHOOSE)
    return {name: tensor.to(device).float().contiguous() for name, tensor in state.items()}


def _fits_the_crop(state: dict[str, Tensor]) -> str:
    """What keeps a network of the right names from running, or ''."""
    width, _, patch, _ = state["encoder.patch_embed.proj.weight"].shape
    doublings = sum(name.startswith("decoder.deconv_layers.") for name in state)
    if 2**doublings != patch:
        return f"its {doublings} doublings do not undo patches of {patch} pixels"
    return "" if width % HEAD_WIDTH == 0 else f"its width of {width} is no multiple of {HEAD_WIDTH}"


def _size(shape: tuple) -> str:
    return " x ".join(map(str, shape)) or "a number"
