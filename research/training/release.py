# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a training ends with: weights as fp16 safetensors and, beside them, the card that says where they come from."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import torch
from safetensors.torch import save_file

from core.capture.files import replacing


@dataclass(frozen=True)
class TrainingCard:
    """What a training's card says beside what its state tells: its configuration; data: in words what was learnt from;
    command: what makes these weights again; held_out: the last figures on held-out data and what they are; more:
    entries that only this training's card has."""

    config: dict
    data: str
    command: str
    held_out: dict
    more: dict = field(default_factory=dict)


def release(out: Path, state: dict, card: TrainingCard, tensors: dict[str, torch.Tensor] | None = None) -> dict:
    """Writes the averaged weights of a training and their card.

    Parameters
    ----------
    out : safetensors; the card is written beside it, as JSON
    state : the training's (descent.py)
    card : what the state does not tell
    tensors : go into the file beside the weights, as they are

    Returns
    -------
    The card as it is written.
    """
    out, named = Path(out), state["data"]
    with replacing(out) as temporary:
        half = {name: value.half().contiguous() for name, value in state["average"].items()}
        save_file({**half, **(tensors or {})}, temporary)
    told = {
        **card.config,
        "data": card.data,
        "licence": "GPL-3.0-or-later",
        "notices": named["notices"],
        "command": card.command,
        "steps": state["step"],
        "minutes": round(state["seconds"] / 60, 1),
        "parameters": sum(v.numel() for v in state["average"].values()),
        "seeds": named["seeds"],
        "held_out_seeds": named["held_out_seeds"],
        "skins": named["skins"],
        "held_out_skins": named["held_out_skins"],
        "held_out": card.held_out,
        **card.more,
    }
    with replacing(out.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(told, indent=1), encoding="utf-8")
    return told


def again(training: str, state: dict) -> str:
    """The command that made a training's weights, but for its own options."""
    data = state["data"]
    skins = f" --skins {data['from']}_carried --held-out {' '.join(data['held_out_skins'])}" if data["skins"] else ""
    minutes = round(state["seconds"] / 60)
    return f"python -m research.training {training} --config {state['config']} --minutes {minutes}{skins}"
