# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Brows and lashes of single hairs."""

from __future__ import annotations

import numpy as np

from core.face.lids import OpenHead
from core.face.strands import SkinSurface, Strands, coloured, grow
from core.geometry.meshes import unit

from ..regions import regions
from .ground import Ground, strew_roots
from .person import Person

RADIUS_M = 0.000045  # of a hair at its root
UPPER, LOWER = (110, 0.0085), (60, 0.0050)  # lashes on a lid, and their length in metres


def grow_brows(person: Person, ground: Ground, skin: SkinSurface, rng: np.random.Generator) -> Strands:
    """Grow brows: upright near the nose, then along the brow, at the tail downwards. Hairs stay out of `skin`."""
    on = ground.canvas
    region = regions(on)["brows"]
    outer = np.abs(on.position[:, :1]) / np.abs(on.landmarks[[70, 300], 0]).mean()  # 0 at the nose ... 1 at the tail
    rise = np.clip(1.5 - 2.2 * outer, -0.35, 1.3)
    way = np.sign(on.position[:, :1]) * [1.0, 0, 0] + rise * [0, 0, 1.0]
    chance = np.clip(region * 2.4 - 1.5 + 0.6 * min(person.brow, 1.3), 0, 1)
    density = (1.25 - 0.6 * outer[:, 0].clip(0, 1)) * 1.15 * person.brow * chance
    roots = strew_roots(ground, density, way, 0.22, rng)
    count = len(roots.at)
    tail = np.clip(np.abs(roots.at[:, 0]) / np.abs(on.landmarks[[70, 300], 0]).mean(), 0, 1.2)
    length = rng.uniform(0.0045, 0.0085, count) * (1.05 - 0.25 * tail)
    points = grow(
        roots, length, rng.normal(0.32, 0.1, count).clip(0.05), skin, -0.35 * roots.normal, np.full(count, 0.0003), 6
    )
    return Strands(
        points,
        np.full(count, RADIUS_M, np.float32),
        coloured(count, np.asarray(person.brow_colour), 0.4 * person.grey, rng),
        "brows",
    )


def grow_lashes(person: Person, head: OpenHead, rng: np.random.Generator) -> Strands:
    """Grow upper lashes that bow up from the lid's edge (closed: down and out), and shorter lower ones."""
    points = []
    for ball, (upper, lower) in zip(head.balls, head.rims, strict=True):
        for rim, (count, length), up in ((upper, UPPER, 1.0), (lower, LOWER, -1.0)):
            edge = head.skin.vertices[rim]
            t = np.sort(rng.uniform(0.06, 0.97, count)) * (len(edge) - 1)
            at = np.stack([np.interp(t, np.arange(len(edge)), edge[:, axis]) for axis in range(3)], 1)
            aside = (at - edge.mean(0)) * [1, 0, 0]
            out = unit(at - ball.centre)
            shut = person.openness < 0.2
            outward = np.array([0, -1.0, -0.55 if shut else 0.05 * up]) + 28 * aside + rng.normal(0, 0.13, at.shape)
            along = np.interp(t / (len(edge) - 1), [0, 0.35, 1], [0.55, 0.9, 1.0])
            size = length * rng.uniform(0.65, 1.1, count) * along
            bow = np.array([0, 0, 0.7 * up if not shut else 0.25])
            points.append(_bowed(at + 0.0002 * out, unit(outward), size, bow))
    lash = np.concatenate(points)
    colour = coloured(len(lash), np.minimum(np.asarray(person.brow_colour) * 0.6, 0.08), 0.0, rng)
    made_up = 1 + 0.5 * person.skin.make_up
    return Strands(lash, np.full(len(lash), made_up * RADIUS_M, np.float32), colour, "lashes")


def _bowed(root: np.ndarray, direction: np.ndarray, length: np.ndarray, bow: np.ndarray) -> np.ndarray:
    """Return points [M, 6, 3] from roots along directions [M, 3], bent by `bow` [3] (share of length) at the tip."""
    t = np.linspace(0, 1, 6)[None, :, None]
    return (root[:, None] + length[:, None, None] * (t * direction[:, None] + t**2 * bow)).astype(np.float32)
