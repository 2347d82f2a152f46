# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the authors' config.json and ckpt.pth, which is read as weights only: nothing in it is ever run."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from ...capture.json_files import read_json
from ...capture.messages import Problem
from ...capture.regular_files import require_regular

DATA_CHANNELS = 7
COND_KINDS = ("coord", "posenc", "noise")
NOISE_FILE = "noise.npy"  # the fixed random map of a prior that is conditioned on one: float32 [3, S, S], the UV square
MAX_NOISE_SIDE = 8192  # texels: twice the side of the largest UV square that is solved
CHOOSE = (
    "Choose the folder with the authors' config.json and ckpt.pth, as they released them, or leave the prior "
    "empty to use ours."
)


def read_config(folder: Path) -> dict:
    """Read config.json as {"model": ..., "cond": ...}, completed. Raises Problem for one that cannot be run."""
    path = folder / "config.json"
    try:
        config = read_json(path)
        entries, cond = dict(config["model"]), dict(config.get("cond") or {})
        model = {
            "type": "image_v1",
            "patch_size": 1,
            "augment_wrapper": True,
            "skip_stages": 0,
            "mapping_cond_dim": 0,
            "cross_cond_dim": 0,
            "has_variance": False,
            "sigma_data": 1.0,
            **entries,
        }
        if model["type"] != "image_v1":
            raise Problem(
                f"{path} describes a model of type {model['type']}, which cannot be run here; image_v1 can.", CHOOSE
            )
        if model["input_channels"] != DATA_CHANNELS:
            raise Problem(
                f"The prior in {folder} models {model['input_channels']} channels.",
                f"Choose one of {DATA_CHANNELS}: diffuse albedo (3), normal (3), specular albedo (1).",
            )
        if model["cross_cond_dim"] and any(model.get("cross_attn_depths") or ()):
            raise Problem(
                f"The prior in {folder} needs a second input through cross attention, which is not known here.", CHOOSE
            )
        levels = len(model["depths"])
        attention = model.get("self_attn_depths") or model["depths"]
        if not len(model["channels"]) == len(attention) == levels > model["skip_stages"] >= 0:
            raise ValueError("depths, channels and self_attn_depths are not of one length")
        kind = cond.setdefault("type", "coord")
        if kind not in COND_KINDS:
            raise ValueError(f"its condition is {kind!r}, not one of {', '.join(COND_KINDS)}")
        if kind == "posenc":
            cond["pos_enc_freq"] = int(cond["pos_enc_freq"])
        sizes = [model["mapping_out"], model["patch_size"], *model["depths"], *model["channels"]]
        if not all(isinstance(size, int) and size > 0 for size in sizes) or not float(model["sigma_data"]) > 0:
            raise ValueError("its sizes are no positive numbers")
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        what = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else error
        raise Problem(f"{path} does not describe a prior ({what}).", CHOOSE) from error
    return {"model": model, "cond": cond}


def read_weights(folder: Path) -> dict[str, torch.Tensor]:
    """Read model_ema of ckpt.pth, or the file as a plain state dict: name -> float32 tensor. Raises Problem."""
    path = folder / "ckpt.pth"
    try:
        with torch.serialization.safe_globals(_harmless()):
            state = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise Problem(f"{folder} holds no ckpt.pth.", CHOOSE) from error
    except Exception as error:  # a damaged or hostile file can make the reader fail in any way
        raise Problem(
            f"{path} cannot be read as weights: it is damaged, or holds more than weights "
            f"({type(error).__name__}). Nothing in it was run.",
            "Download it again from the authors' page.",
        ) from error
    state = state.get("model_ema", state) if isinstance(state, dict) else None
    if not (isinstance(state, dict) and state):
        raise Problem(f"{path} holds no state dict of a network.", CHOOSE)
    if not all(isinstance(name, str) and isinstance(value, torch.Tensor) for name, value in state.items()):
        raise Problem(f"{path} holds no state dict of a network.", CHOOSE)
    return {name: value.float() for name, value in state.items()}


def read_noise(folder: Path) -> torch.Tensor | None:
    """Read the fixed random map [1, 3, S, S] of a prior of condition `noise`; None without one. Raises Problem."""
    path = folder / NOISE_FILE
    if not path.is_file():
        return None
    try:
        # mapped: a header that promises more than the file holds takes no memory
        stored = np.lib.format.open_memmap(require_regular(path), mode="r")
    except (OSError, ValueError, EOFError) as error:
        raise Problem(
            f"{path} cannot be read ({error}).", "Save the map again with numpy, as float32 of shape 3, S, S."
        ) from error
    shape = stored.shape
    fits = len(shape) == 3 and shape == (3, shape[1], shape[1]) and 1 <= shape[1] <= MAX_NOISE_SIDE
    noise = stored.astype(np.float32) if fits and stored.dtype.kind == "f" else np.full(1, np.nan)
    if not np.isfinite(noise).all():
        raise Problem(
            f"{path} has the shape {shape}, or holds values that are not numbers.",
            "Save the map of the whole UV square, of shape 3, S, S.",
        )
    return torch.from_numpy(noise)[None]


def _harmless() -> list:
    """List what training programs leave in a checkpoint beside tensors: numpy's numbers, and command line options."""
    scalar = np.float64(0).__reduce__()[0]
    kinds = [type(np.dtype(name)) for name in ("float64", "float32", "int64", "int32", "bool")]
    return [
        argparse.Namespace,
        np.dtype,
        (scalar, "numpy.core.multiarray.scalar"),
        (scalar, "numpy._core.multiarray.scalar"),
        *kinds,
    ]
