# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a training ends with: weights as fp16 safetensors and, beside them, the card that says where they come from."""

from __future__ import annotations

import json
from pathlib import Path

import torch
from safetensors.torch import save_file

from ..contract.files import replacing


def release(out: Path, state: dict, config: dict, data: str, command: str, held_out: dict, tensors: dict[str, torch.Tensor] | None = None, **more) -> dict:
    """Writes the averaged weights of a training's `state` (descent.py) and their card, which is returned.

    `tensors` go into the file beside the weights as they are, `more` into the card; `data` says in words what was learnt from, `command` what makes these
    weights again, `held_out` the last figures on held-out data and what they are.
    """
    out, named = Path(out), state["data"]
    with replacing(out) as temporary:
        save_file({**{name: value.half().contiguous() for name, value in state["average"].items()}, **(tensors or {})}, temporary)
    card = {**config, "data": data, "licence": "GPL-3.0-or-later", "notices": named["notices"], "command": command, "steps": state["step"],
            "minutes": round(state["seconds"] / 60, 1), "parameters": sum(v.numel() for v in state["average"].values()), "seeds": named["seeds"],
            "held_out_seeds": named["held_out_seeds"], "skins": named["skins"], "held_out_skins": named["held_out_skins"], "held_out": held_out, **more}
    with replacing(out.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(card, indent=1), encoding="utf-8")
    return card


def again(training: str, state: dict) -> str:
    """The command that made a training's weights, but for its own options."""
    data = state["data"]
    skins = f" --skins {data['from']}_carried --held-out {' '.join(data['held_out_skins'])}" if data["skins"] else ""
    return f"python -m core train {training} --config {state['config']} --minutes {round(state['seconds'] / 60)}{skins}"
