# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sky's light that reaches each point of a head past the head itself.

Precomputed radiance transfer (Sloan, Kautz and Snyder 2002) in second-order spherical harmonics, and ambient occlusion,
its part under an even sky.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..geometry.raster import RayCaster
from .spherical_harmonics import UNIFORM, sh_basis


def ambient_occlusion(transfer: np.ndarray) -> np.ndarray:
    """Return the share [...] in [0, 1] of an even sky's light that reaches the surface; 1: nothing in the way."""
    return np.clip(UNIFORM * transfer[..., 0], 0, 1)


def radiance_transfer(
    caster: RayCaster,
    points: np.ndarray,
    normals: np.ndarray,
    rays: int = 128,
    step: Callable[[int, int], None] = lambda done, of: None,
) -> np.ndarray:
    """Return irradiance / pi at surface points per unit of each orthonormal harmonic of radiance, [N, 9].

    points [N, 3] in metres on the caster's mesh, which occludes them; normals unit; `rays` directions are cast; `step`
    hears (done, of).
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
    """Return evenly spread unit directions [count, 3]."""
    i = np.arange(count) + 0.5
    z, angle = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], -1)
