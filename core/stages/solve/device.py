# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which device the networks run on: proven by a pass of the shipped one, not taken for granted because PyTorch names
it.

A graphics card may be too old for PyTorch's kernels, out of memory, or slower than the processor: each is found out
here, once, and said.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import torch

from ...solver.prior.prior import make_coordinates
from .prior_files import WEIGHTS, load

TRIAL_TEXELS = 128
"""Side of the map that is tried, in texels: small enough for any card, and large enough that a card shows what it can
do."""
MAX_DIFFERENCE = 0.05
"""The largest difference between two devices' results, in units of the map's range; bfloat16 differs from float32 by
0.01."""


@dataclass(frozen=True)
class Proof:
    """The device ('cpu', 'cuda' or 'mps'), and why that one: a sentence."""

    device: str
    reason: str


@cache
def prove() -> Proof:
    """The first device that computes what the CPU computes, and faster; the CPU where none does."""
    devices = list_devices()
    if not devices:
        return Proof("cpu", "PyTorch finds no graphics card that it can use.")
    expected, cpu_s = run_pass("cpu")
    reasons = []
    for device in devices:
        try:
            result, seconds = run_pass(device)
        except Exception as error:  # whatever a driver says: the CPU is there
            reasons.append(
                f"{device} does not run the network ({type(error).__name__}: "
                f"{str(error).partition(chr(10))[0][:120].rstrip('.')})."
            )
            continue
        if not torch.isfinite(result).all() or (result - expected).abs().max() > MAX_DIFFERENCE:
            reasons.append(f"{device} computes something else than the CPU.")
        elif seconds >= cpu_s:
            reasons.append(
                f"{device} is slower than the CPU: {seconds:.2f} s against {cpu_s:.2f} s for one pass of the network."
            )
        else:
            return Proof(device, f"{device} takes {seconds:.2f} s for one pass of the network, the CPU {cpu_s:.2f} s.")
    return Proof("cpu", " ".join(reasons))


def list_devices() -> list[str]:
    """The devices that PyTorch names, beside the CPU."""
    return [
        name
        for name, there in (("cuda", torch.cuda.is_available()), ("mps", torch.backends.mps.is_available()))
        if there
    ]


def run_pass(device: str) -> tuple[torch.Tensor, float]:
    """A pass of the shipped prior over a fixed map [1, 7, TRIAL_TEXELS, TRIAL_TEXELS] and back to its input, twice: the
    gradient, on the CPU, and the second one's seconds."""
    generator = torch.Generator().manual_seed(0)
    prior = load(WEIGHTS, device).of_tone(torch.tensor([0.45, 0.3, 0.22]))
    noisy, weights = (torch.randn(1, 7, TRIAL_TEXELS, TRIAL_TEXELS, generator=generator).to(device) for _ in range(2))
    weights = weights / (7 * TRIAL_TEXELS * TRIAL_TEXELS) ** 0.5
    middle = slice(512 - TRIAL_TEXELS // 2, 512 + TRIAL_TEXELS // 2)
    coords = make_coordinates(1024, middle, middle).to(device)
    for _ in range(2):  # the first one brings kernels and memory
        started = time.perf_counter()
        x = noisy.clone().requires_grad_(True)
        denoised = prior(x, 1.0, coords)
        (gradient,) = torch.autograd.grad((denoised * weights).sum(), x)
        result = torch.cat([denoised.detach(), gradient], 1).cpu()  # which waits for the device
        seconds = time.perf_counter() - started
    return result, seconds
