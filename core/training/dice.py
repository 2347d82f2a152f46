# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random numbers as float32 tensors of a device. A few come from the processor, and are the same on every device; noise
of many is the device's own."""

from __future__ import annotations

import numpy as np
import torch


class Dice:
    """rng is the processor's, `device` where the tensors lie."""

    def __init__(self, rng: np.random.Generator, device: str):
        self.rng, self.device = rng, device
        self._generator = torch.Generator(device).manual_seed(int(rng.integers(2**62)))

    def uniform(self, low: float, high: float, *shape: int) -> torch.Tensor:
        return self._there(self.rng.uniform(low, high, shape))

    def spread(self, low: float, high: float, *shape: int) -> torch.Tensor:
        """Evenly over the logarithm."""
        return self._there(np.exp(self.rng.uniform(np.log(low), np.log(high), shape)))

    def normal(self, mean: float, deviation, *shape: int) -> torch.Tensor:
        return self._there(self.rng.normal(mean, deviation, shape))

    def happens(self, share: float, *shape: int) -> torch.Tensor:
        """1 in this share of the cases, else 0."""
        return self._there(self.rng.random(shape) < share)

    def whole(self, below: int, *shape: int) -> torch.Tensor:
        """int64 in 0 ... below - 1."""
        return torch.as_tensor(self.rng.integers(below, size=shape), device=self.device)

    def noise(self, *shape: int) -> torch.Tensor:
        """Normal, of deviation 1."""
        return torch.randn(shape, generator=self._generator, device=self.device)

    def _there(self, array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(np.asarray(array, np.float32), device=self.device)
