# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Find a head's eyeballs, their turns by its look units, and the rims of its lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...data_blocks import read_field
from ..asset import LEFT_EYE, SIDES, FaceUnits, load

WAYS = ("Up", "Down", "In", "Out")
WHITE_RAD = 0.6
"""Angle from the gaze beyond which an eyeball is a sphere, without its cornea."""


@dataclass(frozen=True)
class RiggedEyeball:
    """Eyeball in the head's axes, metres and radians.

    pitch (upwards) and yaw (to the person's left): direction at rest; turns: what each look unit at 1 adds to both.
    """

    centre: np.ndarray  # [3]
    radius: float
    pitch: float
    yaw: float
    turns: dict[str, tuple[float, float]]

    def ahead(self) -> np.ndarray:
        """Return the direction at rest, a unit vector [3]."""
        level = np.cos(self.pitch)
        return np.array([level * np.sin(self.yaw), -level * np.cos(self.yaw), np.sin(self.pitch)])


@dataclass(frozen=True)
class LidRims:
    """Vertices of one eye's lids, from the nose outwards."""

    upper: np.ndarray  # [N]
    lower: np.ndarray  # [N], opposite the upper ones
    corner: int


def of(obj, number: int, beyond_rad: float = WHITE_RAD) -> RiggedEyeball:
    """Fit the left (0) or right eyeball of a head at rest to its vertices beyond an angle from the gaze."""
    asset, keys = load(), obj.data.shape_keys.key_blocks
    inner = np.flatnonzero(asset.kind == LEFT_EYE + number)
    rows, out = asset.first_inner + inner, np.linalg.norm(asset.uvs[inner] - 0.5, axis=1)
    rest = places(keys[0])
    # the UV grows with the angle from the gaze (research/people/base_head/acting.py)
    sphere = rest[rows[np.pi * (2 * out) ** (1 / 0.6) > beyond_rad]]
    terms = np.concatenate([2 * sphere, np.ones((len(sphere), 1))], 1)
    fit = np.linalg.lstsq(terms, (sphere**2).sum(1), rcond=None)[0]
    centre, pupil = fit[:3], rows[out.argmin()]
    pitch, yaw = _angles(rest[pupil] - centre)
    turned = {way: _angles(places(keys[f"eyeLook{way}{SIDES[number]}"])[pupil] - centre) for way in WAYS}
    turns = {way: (a - pitch, b - yaw) for way, (a, b) in turned.items()}
    return RiggedEyeball(centre, float(np.sqrt(fit[3] + centre @ centre)), pitch, yaw, turns)


def rims(asset: FaceUnits, number: int) -> LidRims:
    """Return the rims of the left (0) or right lids, as rows of the cut head."""
    seam = np.flatnonzero(asset.seam == 1 + number)
    seam = seam[np.abs(asset.template[asset.copies[seam], 0]).argsort()]
    triangles = asset.cut_triangles()
    upper, lower = asset.copies[seam], len(asset.template) + seam
    around = [set(triangles[(triangles == rim).any(1)].ravel().tolist()) for rim in (upper[0], lower[0])]
    return LidRims(upper, lower, (around[0] & around[1]).pop())


def places(key) -> np.ndarray:
    """Return the vertices [N, 3] of a shape key."""
    return read_field(key.data, "co", 3).astype(np.float64)


def _angles(direction: np.ndarray) -> tuple[float, float]:
    x, y, z = direction
    return float(np.arctan2(z, np.hypot(x, y))), float(np.arctan2(x, -y))
