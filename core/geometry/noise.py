# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise in the space of the head, so that it knows no UV seam: random lattices in 3D, read at the surface's points in
mm."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

LATTICE_NODES = 48  # nodes per side; the noise repeats after so many wavelengths


def noise(points: np.ndarray, wavelength: float, rng: np.random.Generator, smooth: bool = False) -> np.ndarray:
    """Noise of mean 0 and deviation 1.

    Parameters
    ----------
    points : [N, 3], in mm
    wavelength : mm; features are about that large
    rng : of the lattice
    smooth : takes cubic B-splines (for few points or large features), otherwise faded linear interpolation (eight times
        faster)

    Returns
    -------
    float32 [N].
    """
    lattice = rng.standard_normal((LATTICE_NODES,) * 3).astype(np.float32)
    turn = Rotation.random(random_state=rng).as_matrix().astype(np.float32)  # hides the lattice's axes
    turned = (points.astype(np.float32) @ (turn / np.float32(wavelength))).T
    at = turned + rng.uniform(0, LATTICE_NODES, (3, 1)).astype(np.float32)
    if smooth:
        # 1 / mean deviation
        return map_coordinates(lattice, at, np.float32, order=3, mode="grid-wrap", prefilter=False) * np.float32(3.03)
    node = np.floor(at)
    fraction = at - node
    at = node + fraction * fraction * (3 - 2 * fraction)
    return map_coordinates(lattice, at, np.float32, order=1, mode="grid-wrap") * np.float32(1.57)


def octaves(points: np.ndarray, wavelengths: list[float], rng: np.random.Generator, smooth: bool = False) -> np.ndarray:
    """The sum of `noise` over wavelengths, again of deviation 1.

    Parameters
    ----------
    points : [N, 3], in mm
    wavelengths : in mm
    rng, smooth : as in `noise`

    Returns
    -------
    float32 [N].
    """
    total = sum(noise(points, wavelength, rng, smooth) for wavelength in wavelengths)
    return total / np.float32(np.sqrt(len(wavelengths)))
