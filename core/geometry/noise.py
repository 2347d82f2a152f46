# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise in the space of the head, so that it has no UV seams: random 3D lattices, read at surface points in mm."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

LATTICE_NODES = 48  # per side; the noise repeats after as many wavelengths


def noise(points: np.ndarray, wavelength: float, rng: np.random.Generator, smooth: bool = False) -> np.ndarray:
    """Return noise of mean 0 and deviation 1 at points [N, 3] in mm, float32 [N]; features are `wavelength` mm large.

    `rng` draws the lattice. `smooth`: cubic B-splines, for few points or large features; otherwise faded linear
    interpolation, eight times faster.
    """
    lattice = rng.standard_normal((LATTICE_NODES,) * 3).astype(np.float32)
    rotation = Rotation.random(random_state=rng).as_matrix().astype(np.float32)  # hides the lattice's axes
    rotated = (points.astype(np.float32) @ (rotation / np.float32(wavelength))).T
    at = rotated + rng.uniform(0, LATTICE_NODES, (3, 1)).astype(np.float32)
    if smooth:
        # one over the mean deviation
        return map_coordinates(lattice, at, np.float32, order=3, mode="grid-wrap", prefilter=False) * np.float32(3.03)
    node = np.floor(at)
    fraction = at - node
    at = node + fraction * fraction * (3 - 2 * fraction)
    return map_coordinates(lattice, at, np.float32, order=1, mode="grid-wrap") * np.float32(1.57)


def octaves(points: np.ndarray, wavelengths: list[float], rng: np.random.Generator, smooth: bool = False) -> np.ndarray:
    """Return the sum of `noise` over wavelengths in mm, scaled to deviation 1, float32 [N]."""
    total = sum(noise(points, wavelength, rng, smooth) for wavelength in wavelengths)
    return total / np.float32(np.sqrt(len(wavelengths)))
