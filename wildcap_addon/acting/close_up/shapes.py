# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of an eye: a white that fades out over a recessed iris with a hole for a pupil, and the clear shell over both.

The gaze is -y, lengths are metres, and all lies inside the ball to which the head's own lids were fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

IRIS_M = 0.0059
"""Radius of an adult's iris."""
LIMBUS_AT = (0.33, 0.46)
"""Limits of the iris' angle from the gaze: the cornea over it has to end within the ball's own, at 0.52."""
BULGE_SHARE = 0.06
"""Height of the cornea over the white's sphere, as a share of the radius: 0.9 to 1 mm."""
EDGE_RAD = 0.08
"""Angle beyond the iris at which the cornea meets the white's sphere."""
FILM_M = 0.00012
"""Gap between the white and the clear shell."""
SOFT_RAD = 0.075
"""Angle on either side of the iris' rim over which the white fades."""
BACK_RAD, SHELL_BACK_RAD = 2.4, 2.0
"""Angles from the gaze at which white and shell end; lids cover the rest."""
PUPIL_SHARE = 0.34
"""Radius of the pupil relative to the iris'."""
ROOT_M, DISH_M = 0.0001, 0.00065
"""Depth of the iris' outer edge behind the plane of the limbus, and of its inner edge behind the outer one."""
TURNS = 96
WHITE, IRIS, PUPIL_SLOT = range(3)


@dataclass(frozen=True)
class Turned:
    """Mesh of revolution about the gaze."""

    vertices: np.ndarray  # [V, 3]
    faces: np.ndarray  # [F, 4]
    uvs: np.ndarray  # [F, 4, 2] around and from the middle outwards
    slots: np.ndarray  # [F]


def limbus(radius: float, iris_m: float) -> float:
    """Return the angle from the gaze at which the iris ends on a ball."""
    return float(np.clip(np.arcsin(min(0.9, iris_m / radius)), *LIMBUS_AT))


def surface(angle: np.ndarray, radius: float, edge: float) -> np.ndarray:
    """Return the distance of the shell from the ball's centre at angles from the gaze; edge: the limbus."""
    return radius * (1 + BULGE_SHARE * np.clip(1 - (angle / (edge + EDGE_RAD)) ** 2, 0, None) ** 1.5)


def shell(radius: float, edge: float) -> Turned:
    """Return the cornea, and tears over the white, as one smooth surface."""
    seam = edge + EDGE_RAD
    angle = np.concatenate([np.linspace(1e-4, seam, 22), np.linspace(seam, SHELL_BACK_RAD, 20)[1:]])
    far = surface(angle, radius, edge)
    return _turn([(far * np.sin(angle), -far * np.cos(angle), angle / SHELL_BACK_RAD, 0)])


def inner(radius: float, edge: float) -> Turned:
    """Return white, iris and the dark behind the pupil."""
    white, soft = radius - FILM_M, edge + SOFT_RAD
    angle = np.concatenate(
        [
            np.linspace(edge - SOFT_RAD, soft, 8),
            np.linspace(soft, 1.6, 14)[1:],
            np.linspace(1.6, BACK_RAD, 6)[1:],
        ]
    )
    v = np.clip((angle - edge + SOFT_RAD) / (1.6 - edge + SOFT_RAD), 0.002, 0.998)
    outside = (white * np.sin(angle), -white * np.cos(angle), v, WHITE)
    rim, plane = white * np.sin(edge), -white * np.cos(edge) + ROOT_M
    across = np.linspace(0, 1.04, 20)  # a little beyond where the white begins
    hole = PUPIL_SHARE * rim
    iris = (hole + across * (rim - hole), plane + DISH_M * (1 - across), np.clip(across, 0.002, 0.998), IRIS)
    behind = np.array([hole, 1.05 * hole, 0.8 * hole, 0.0001])
    dark = (behind, plane + DISH_M + np.array([0, 0.0004, 0.0014, 0.0016]), np.zeros(4), PUPIL_SLOT)
    return _turn([outside, iris, dark])


def _turn(profiles: list[tuple]) -> Turned:
    """Revolve profiles: distance [R] from the axis, y [R], the UVs' v [R], and a slot.

    Rings go from the gaze outwards, except for the dark behind the pupil.
    """
    k, first = np.arange(TURNS), 0
    n, turn = (k + 1) % TURNS, k * 2 * np.pi / TURNS
    vertices, faces, uvs, slots = [], [], [], []
    for away, y, v, slot in profiles:
        x, z = away[:, None] * np.cos(turn), away[:, None] * np.sin(turn)
        vertices.append(np.stack([x, y[:, None] + 0 * turn, z], -1).reshape(-1, 3))
        for ring in range(len(away) - 1):
            a, b = first + ring * TURNS, first + (ring + 1) * TURNS
            quad = np.stack([a + k, b + k, b + n, a + n], 1)
            ends = (0, ring), (0, ring + 1), (1, ring + 1), (1, ring)
            uv = np.stack([np.stack([(k + step) / TURNS, 0 * k + v[row]], 1) for step, row in ends], 1)
            order = slice(None, None, -1 if slot == PUPIL_SLOT else 1)
            faces.append(quad[:, order])
            uvs.append(uv[:, order])
            slots.append(np.full(TURNS, slot))
        first += len(away) * TURNS
    return Turned(np.concatenate(vertices), np.concatenate(faces), np.concatenate(uvs), np.concatenate(slots))
