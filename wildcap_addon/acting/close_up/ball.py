# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a head's eyeballs are and how its look units turn them, and which of its vertices are the rims of its lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...data_blocks import read_field
from ..asset import LEFT_EYE, SIDES, FaceUnits, load

WAYS = ("Up", "Down", "In", "Out")
WHITE_RAD = 0.6
"""Radians from the gaze beyond which a ball is a sphere, and not its cornea."""


@dataclass(frozen=True)
class RiggedEyeball:
    """centre [3] and radius in metres, in the head's axes; pitch and yaw in radians: where it looks at rest, upwards
    and to the person's left; turns: what each look unit at 1 adds to them."""

    centre: np.ndarray
    radius: float
    pitch: float
    yaw: float
    turns: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class LidRims:
    """Of one eye, from the nose outwards: vertices of the upper rim [N] and of the lower one [N], opposite one another,
    and the inner corner's."""

    upper: np.ndarray
    lower: np.ndarray
    corner: int


def of(obj, number: int) -> RiggedEyeball:
    """The left (0) or the right ball of a head at rest."""
    asset, keys = load(), obj.data.shape_keys.key_blocks
    inner = np.flatnonzero(asset.kind == LEFT_EYE + number)
    rows, out = len(asset.template) + len(asset.copies) + inner, np.linalg.norm(asset.uvs[inner] - 0.5, axis=1)
    rest = places(keys[0])
    # the UV grows with the angle from the gaze (research/people/base_head/acting.py)
    white = rest[rows[np.pi * (2 * out) ** (1 / 0.6) > WHITE_RAD]]
    fit = np.linalg.lstsq(np.concatenate([2 * white, np.ones((len(white), 1))], 1), (white**2).sum(1), rcond=None)[0]
    centre, pupil = fit[:3], rows[out.argmin()]
    pitch, yaw = _angles(rest[pupil] - centre)
    turned = {way: _angles(places(keys[f"eyeLook{way}{SIDES[number]}"])[pupil] - centre) for way in WAYS}
    return RiggedEyeball(
        centre,
        float(np.sqrt(fit[3] + centre @ centre)),
        pitch,
        yaw,
        {way: (a - pitch, b - yaw) for way, (a, b) in turned.items()},
    )


def rims(asset: FaceUnits, number: int) -> LidRims:
    """Of the left (0) or the right lids, as rows of the head cut open."""
    seam = np.flatnonzero(asset.seam == 1 + number)
    seam = seam[np.abs(asset.template[asset.copies[seam], 0]).argsort()]
    triangles = asset.triangles.copy()
    triangles[asset.corners[:, 0], asset.corners[:, 1]] = asset.corners[:, 2]
    upper, lower = asset.copies[seam], len(asset.template) + seam
    around = [set(triangles[(triangles == rim).any(1)].ravel().tolist()) for rim in (upper[0], lower[0])]
    return LidRims(upper, lower, (around[0] & around[1]).pop())


def places(key) -> np.ndarray:
    """Vertices [N, 3] of a shape key."""
    return read_field(key.data, "co", 3).astype(np.float64)


def _angles(way: np.ndarray) -> tuple[float, float]:
    return float(np.arctan2(way[2], np.hypot(way[0], way[1]))), float(np.arctan2(way[0], -way[1]))
