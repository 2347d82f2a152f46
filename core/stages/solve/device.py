# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Choose the device of the networks by a pass of the shipped one: a card may be too old, too small or too slow."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import torch

from ...solver.prior.prior import make_coordinates
from .prior_files import WEIGHTS, load

TRIAL_TEXELS = 128  # side of the map that is tried: small enough for any card, and large enough to show its speed
MAX_DIFFERENCE = 0.05  # between two devices' results, in units of the map's range; bfloat16 is off by 0.01


@dataclass(frozen=True)
class Proof:
    """Device ('cpu', 'cuda' or 'mps') and the reason for it, a sentence."""

    device: str
    reason: str


@cache
def prove() -> Proof:
    """Return the first device that computes what the CPU computes, and faster; else the CPU."""
    devices = list_devices()
    if not devices:
        return Proof("cpu", "PyTorch finds no graphics card that it can use.")
    expected, cpu_s = run_pass("cpu")
    reasons = []
    for device in devices:
        try:
            result, seconds = run_pass(device)
        except Exception as error:  # whatever a driver says: the CPU is there
            message = str(error).partition("\n")[0][:120].rstrip(".")
            reasons.append(f"{device} does not run the network ({type(error).__name__}: {message}).")
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
    """List the devices that PyTorch names, beside the CPU."""
    available = {"cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available()}
    return [name for name, is_available in available.items() if is_available]


def run_pass(device: str) -> tuple[torch.Tensor, float]:
    """Run the shipped prior over a map and back; return [1, 14, S, S] on the CPU, and a second pass's seconds."""
    generator = torch.Generator().manual_seed(0)
    prior = load(WEIGHTS, device).of_tone(torch.tensor([0.45, 0.3, 0.22]))
    noisy, weights = (torch.randn(1, 7, TRIAL_TEXELS, TRIAL_TEXELS, generator=generator).to(device) for _ in range(2))
    weights = weights / (7 * TRIAL_TEXELS * TRIAL_TEXELS) ** 0.5
    middle = slice(512 - TRIAL_TEXELS // 2, 512 + TRIAL_TEXELS // 2)
    coords = make_coordinates(1024, middle, middle).to(device)
    for _ in range(2):  # the first pass loads kernels and memory
        started = time.perf_counter()
        x = noisy.clone().requires_grad_(True)
        denoised = prior(x, 1.0, coords)
        (gradient,) = torch.autograd.grad((denoised * weights).sum(), x)
        result = torch.cat([denoised.detach(), gradient], 1).cpu()  # which waits for the device
        seconds = time.perf_counter() - started
    return result, seconds
