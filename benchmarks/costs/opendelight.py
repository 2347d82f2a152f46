# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame costs by OpenDelight's networks:

    python -m benchmarks.costs opendelight [--frames N] [--device cpu|cuda] [--json OUT.json]

The checkpoint is random, of the published shapes, so the time and the memory are those of the real one and the pictures
mean nothing. Told are the multiplications of a frame, seconds per frame, beside them how long 10^12 multiplications of
one large matrix product take on the same machine at the same time, the longest time between two looks at a cancel, and
the peak memory.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
from torch.utils.flop_counter import FlopCounterMode

from core.delight.opendelight_checkpoint import BASE, ENHANCER, load
from core.delight.opendelight_network import delight_crop

from ..figures import plain, write_record
from .meter import peak, spending

SIZE = 512


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.costs opendelight",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--frames", type=int, default=1)
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--json", type=Path, help="where the figures go, such as docs/figures/opendelight_cost.json")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        write_random_checkpoint(Path(folder))
        checkpoint = load(folder, options.device)
    before = _peak_gb(options.device)
    picture = torch.rand(1, 3, SIZE, SIZE, generator=torch.Generator().manual_seed(0)).to(options.device)
    yardsticks, frames, steps = [_yardstick(options.device)], [], []
    for _ in range(options.frames):
        frames.append(
            _seconds(
                lambda: delight_crop(
                    checkpoint.base, checkpoint.enhancer, picture, lambda: steps.append(time.monotonic())
                ),
                options.device,
            )
        )
        yardsticks.append(_yardstick(options.device))
    found = plain(
        {
            "tera_multiplications": round(multiplications(), 2),
            "peak_gb": round(_peak_gb(options.device), 1),
            "seconds": round(np.mean(frames), 1),
            "seconds_of_a_product": round(np.mean(yardsticks), 1),
            "seconds_to_cancel": round(np.diff(steps).max(), 1),
        }
    )
    print(f"{options.device}, {torch.get_num_threads()} threads, {before:.1f} GB before the first frame:", found)
    if options.json:
        write_record(options.json, "costs", "python -m benchmarks.costs opendelight", found)


def multiplications() -> float:
    """Of one frame, in 10^12, counted without computing anything."""
    with torch.device("meta"), FlopCounterMode(display=False) as counter:
        delight_crop(
            *({name: torch.zeros(shape) for name, shape in shapes.items()} for shapes in (base(), enhancer())),
            torch.zeros(1, 3, SIZE, SIZE),
        )
    return counter.get_total_flops() / 2e12


def write_random_checkpoint(
    folder: Path, width: int = 768, depth: int = 12, channels: int = 512, unet: int = 64, seed: int = 0
) -> None:
    """Writes the two files of a checkpoint with random values; sizes that are not given are the published ones.

    Parameters
    ----------
    folder : takes both
    width : channels of a token of the base network
    depth : its blocks
    channels : of its decoder
    unet : channels of the enhancer's first level
    seed : of the values
    """
    rng = torch.Generator().manual_seed(seed)
    for name, shapes in ((BASE, base(width, depth, channels)), (ENHANCER, enhancer(unet))):
        torch.save({key: _random(key, shape, rng) for key, shape in shapes.items()}, folder / name)


def base(width: int = 768, depth: int = 12, channels: int = 512) -> dict[str, tuple[int, ...]]:
    """Name -> shape of the first network's tensors, written down from the authors' published configuration."""
    shapes = {
        "encoder.cls_token": (1, 1, width),
        "encoder.reg_token": (2, 4, width),
        "encoder.patch_embed.proj.weight": (width, 3, 16, 16),
        "encoder.patch_embed.proj.bias": (width,),
        "encoder.norm.weight": (width,),
        "encoder.norm.bias": (width,),
    }
    for i in range(depth):
        for layer, out, into in (
            ("attn.qkv", 3 * width, width),
            ("attn.proj", width, width),
            ("mlp.fc1", 4 * width, width),
            ("mlp.fc2", width, 4 * width),
        ):
            shapes |= {f"encoder.blocks.{i}.{layer}.weight": (out, into), f"encoder.blocks.{i}.{layer}.bias": (out,)}
        for layer in ("norm1", "norm2"):
            shapes |= {f"encoder.blocks.{i}.{layer}.weight": (width,), f"encoder.blocks.{i}.{layer}.bias": (width,)}
    for i in (0, 3, 6, 9):
        shapes |= {
            f"decoder.deconv_layers.{i}.weight": (channels if i else width, channels, 4, 4),
            f"decoder.conv_layers.{i}.weight": (channels, channels, 1, 1),
            f"decoder.conv_layers.{i}.bias": (channels,),
        }
    return shapes | {"decoder.cls_conv.weight": (3, channels, 1, 1), "decoder.cls_conv.bias": (3,)}


def enhancer(width: int = 64) -> dict[str, tuple[int, ...]]:
    """The same of the second network, a residual U-Net."""
    shapes: dict[str, tuple[int, ...]] = {}

    def put(name: str, kernel: int, out: int, into: int) -> None:
        shapes.update({f"{name}.weight": (out, into, kernel, kernel), f"{name}.bias": (out,)})

    def put_norm(name: str, size: int) -> None:
        shapes.update(
            {f"{name}.{kind}": (size,) for kind in ("weight", "bias", "running_mean", "running_var")}
            | {f"{name}.num_batches_tracked": ()}
        )

    at = "inc_1.res_conv."
    put(at + "0", 3, width, 6)
    put_norm(at + "1", width)
    put(at + "3", 3, width, width)
    put_norm(at + "4", width)
    put("inc_1.addtion_layer", 1, width, 6)
    for name, into, out in (
        ("down1_1.resdown_conv.1", 1, 2),
        ("down2_1.resdown_conv.1", 2, 4),
        ("down3_1.resdown_conv.1", 4, 8),
        ("down4_1.resdown_conv.1", 8, 8),
        ("up1_1.conv", 16, 4),
        ("up2_1.conv", 8, 2),
        ("up3_1.conv", 4, 1),
        ("up4_1.conv", 2, 1),
    ):
        put_norm(f"{name}.res_conv.0", into * width), put(f"{name}.res_conv.2", 3, out * width, into * width)
        put_norm(f"{name}.res_conv.3", out * width), put(f"{name}.res_conv.5", 3, out * width, out * width)
        if into != out:
            put(f"{name}.addtion_layer", 1, out * width, into * width)
    put("outc_1.conv", 1, 3, width)
    return shapes


def _random(name: str, shape: tuple[int, ...], rng: torch.Generator) -> torch.Tensor:
    """Of such a size that the signal neither dies nor explodes on its way."""
    if not shape:
        return torch.zeros((), dtype=torch.long)
    if name.endswith(("running_var",)) or ("norm" in name and name.endswith("weight")):
        return 0.5 + torch.rand(shape, generator=rng)
    return torch.randn(shape, generator=rng) * (1 / math.sqrt(math.prod(shape[1:])) if len(shape) > 1 else 0.1)


def _yardstick(device: str) -> float:
    a = torch.ones(4096, 4096, device=device)
    return _seconds(lambda: a @ a, device) * 1e12 / 4096**3


def _seconds(work, device: str) -> float:
    with spending(torch.cuda.synchronize if device == "cuda" else lambda: None) as spent:
        work()
    return spent.seconds


def _peak_gb(device: str) -> float:
    """Of the process, or of the graphics card."""
    return (torch.cuda.max_memory_allocated() if device == "cuda" else peak()) / 1e9
