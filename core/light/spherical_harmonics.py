# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Real spherical harmonics to the second order, for numpy arrays and torch tensors; their polynomials stand here only.

Order (l, m): (0, 0), (1, -1), (1, 0), (1, 1), (2, -2), (2, -1), (2, 0), (2, 1), (2, 2), that is 1, y, z, x, xy, yz, 3
z^2 - 1, xz, x^2 - y^2. Signs with the Condon-Shortley phase: functions of odd m are negative where their polynomial is
positive, as in the code of the method's authors. A function is a factor of its band times a polynomial; `bands` chooses
the factors.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import TypeVar

import numpy as np

Array = TypeVar("Array")  # numpy.ndarray or torch.Tensor
Bands = tuple[float, float, float]

ORTHONORMAL: Bands = (sqrt(1 / (4 * pi)), sqrt(3 / (4 * pi)), sqrt(15 / (4 * pi)))
"""Factors of the bands 0, 1 and 2 that make the functions orthonormal on the sphere."""
LAMBERT: Bands = (1.0, 2 / 3, 1 / 4)
"""Irradiance over pi of a Lambertian surface per band of radiance (Ramamoorthi and Hanrahan 2001: A_l over pi)."""
GAMMA_BANDS: Bands = tuple(
    y * pi * lambert * scale
    for y, lambert, scale in zip(ORTHONORMAL, LAMBERT, (1.0, sqrt(3), 2 * sqrt(2)), strict=True)
)
"""The parameterisation of gamma in the authors' code: the irradiance pi, 2 pi / 3, pi / 4 of orthonormal radiance, and
its bands once more times 1, sqrt 3 and 2 sqrt 2. Together pi, 2 pi / sqrt 3 and pi / sqrt 2."""
UNIFORM = 1 / ORTHONORMAL[0]
"""The orthonormal coefficient of radiance 1 from everywhere."""


def sh_basis(directions: Array, bands: Bands = ORTHONORMAL, axis: int = -1) -> Array:
    """Return the nine functions in unit directions whose x, y and z lie along `axis`: [..., 3] -> [..., 9].

    Lengths other than one enter the polynomials as they are. The kind of array and its precision stay.
    """
    one, *first, xy, yz, zz, xz, xx_yy = sh_polynomials(directions, axis)
    b0, b1, b2 = bands
    harmonics = [b0 * one, *(b1 * p for p in first), *(b2 * p for p in (xy, yz, zz / (2 * 3**0.5), xz, xx_yy / 2))]
    if isinstance(directions, np.ndarray):
        return np.stack(harmonics, axis)
    import torch  # loaded already by callers with tensors; arrays need numpy alone

    return torch.stack(harmonics, axis)


def sh_polynomials(directions: Array, axis: int = -1) -> list[Array]:
    """Return the polynomials of the nine functions, with signs, each without the dimension `axis`."""
    x, y, z = np.moveaxis(directions, axis, 0) if isinstance(directions, np.ndarray) else directions.movedim(axis, 0)
    return [x**0, -y, z, -x, x * y, -y * z, 3 * z * z - 1, -x * z, x * x - y * y]


def per_function(bands: Bands) -> tuple[float, ...]:
    """Repeat one value for each band for each of its functions."""
    first, second, third = bands
    return (first, *[second] * 3, *[third] * 5)
