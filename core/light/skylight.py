# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of the sky each point of a head sees past the head itself: precomputed radiance transfer (Sloan, Kautz and
Snyder 2002) in second-order spherical harmonics, and ambient occlusion, which is its part under an even sky.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..geometry.raster import RayCaster
from .spherical_harmonics import UNIFORM, sh_basis


def ambient_occlusion(transfer: np.ndarray) -> np.ndarray:
    """radiance_transfer [..., 9] -> [...] in [0, 1]: the share of an even sky's light that reaches the surface; 1 where
    nothing is in the way."""
    return np.clip(UNIFORM * transfer[..., 0], 0, 1)


def radiance_transfer(
    caster: RayCaster,
    points: np.ndarray,
    normals: np.ndarray,
    rays: int = 128,
    step: Callable[[int, int], None] = lambda done, of: None,
) -> np.ndarray:
    """Irradiance / pi at surface points from the radiance of each orthonormal harmonic (spherical_harmonics.py),
    occluded by the mesh.

    Parameters
    ----------
    caster : of the mesh
    points : [N, 3] on it, in metres
    normals : [N, 3], unit
    rays : directions that are cast
    step : hears (done, of)

    Returns
    -------
    [N, 9].
    """
    transfer = np.zeros((len(points), 9))
    directions = fibonacci_sphere(rays)
    basis = sh_basis(directions)
    for i, direction in enumerate(directions):
        if i % 8 == 0:
            step(i, rays)
        cosine = normals @ direction
        facing = np.flatnonzero(cosine > 0)
        free = facing[
            ~caster.blocked(points[facing] + 1e-3 * normals[facing], np.repeat(direction[None], len(facing), 0))
        ]
        transfer[free] += cosine[free, None] * basis[i] * (4 / rays)
    return transfer


def fibonacci_sphere(count: int) -> np.ndarray:
    """Evenly spread unit directions [count, 3]."""
    i = np.arange(count) + 0.5
    z, angle = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], -1)
