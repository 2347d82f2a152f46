# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stubble, moustaches and full beards of single hairs."""

from __future__ import annotations

import numpy as np

from core.face.strands import SkinSurface, Strands, clumped, coloured, grow, waved
from core.geometry.noise import octaves

from ..canvas import Canvas
from ..regions import regions
from .ground import Ground, strew_roots
from .person import Person

DENSITY = {"stubble": 0.75, "moustache": 1.3, "full": 0.85}  # hairs per mm^2 where it is densest
SIDEBURNS = [[162, 127, 234, 93], [389, 356, 454, 323]]  # from the temples down before the ears
RADIUS_M = {"stubble": 0.00004, "moustache": 0.00005, "full": 0.00006}  # of a hair at its root


def grow_beard(person: Person, ground: Ground, skin: SkinSurface, rng: np.random.Generator) -> Strands:
    """Grow a beard that leaves the mouth free and falls; a longer one is bent down and clumps.

    The person's beard is not "none"; hairs stay out of `skin`.
    """
    on, kind = ground.canvas, person.beard
    density = DENSITY[kind] * beard_density(kind, on, np.random.default_rng([person.seed, 65]))
    roots = strew_roots(ground, density, _ways(on), 0.3, rng)
    count = len(roots.at)
    # a moustache is kept out of the mouth
    upper = np.clip((roots.at[:, 2] - on.landmarks[0, 2] + 6) / 8, 0, 1) * (np.abs(roots.at[:, 0]) < 32)
    # full on the chin, short by the ears
    most = np.interp(np.abs(roots.at[:, 0]), [0, 30, 60], [1.0, 0.8, 0.45]) if kind == "full" else np.ones(count)
    length = person.beard_length * rng.uniform(0.55, 1.15, count) * most
    length = np.where(upper > 0.5, np.minimum(length, 0.009 * rng.uniform(0.6, 1.1, count)), length)
    lift = rng.normal(0.75 if kind == "stubble" else 0.6, 0.15, count).clip(0.1, 1.3)
    steps = 4 if kind == "stubble" else 8
    pull = np.array([0, 0.12, -0.9]) * np.clip(length / 0.02, 0, 1)[:, None] - 0.35 * roots.normal
    points = grow(roots, length, lift, skin, pull, length * rng.uniform(0.05, 0.45, count), steps)
    if kind != "stubble":
        points = waved(points, roots.at, 0.12 * person.beard_length * (0.4 + person.curl), 6.0, rng)
        points = clumped(points, 9, 0.35, rng)
    colour = coloured(count, np.asarray(person.hair_colour) * 0.9, min(1.0, 1.4 * person.grey), rng)
    return Strands(points, np.full(count, RADIUS_M[kind], np.float32), colour, "beard")


def beard_density(kind: str, on: Canvas, rng: np.random.Generator) -> np.ndarray:
    """Return the beard's density on a canvas, [N] in [0, 1], with the gaps that beards have."""
    region = (
        _moustache(on)
        if kind == "moustache"
        else np.maximum(beard_region(on), 0.9 * _sideburns(on) * (1 - regions(on)["ears"]))
    )
    patchy = on.soft(lambda at: octaves(at, [16.0, 9.0], rng, smooth=True))
    return np.clip(region * (1.05 + 0.15 * patchy) - 0.05, 0, 1)


def beard_region(on: Canvas) -> np.ndarray:
    """Return the region [N] in [0, 1] where a man's beard can grow.

    Below a line from the ears to the corners of the nose, before the ears, down to below the jaw.
    """
    x, y, z = np.abs(on.position[:, 0]), on.position[:, 1], on.position[:, 2]
    nose, corner, chin, ear = (on.landmarks[mark] for mark in (2, 291, 152, 454))
    line = np.interp(
        x,
        [0, 13, 24, 36, 52, ear[0]],
        [nose[2] + 1, nose[2] - 2, nose[2] - 2, corner[2] + 15, corner[2] + 25, ear[2] - 5],
    )
    jaw = np.interp(y, [chin[1], ear[1] - 10], [chin[2] - 10, corner[2] - 22])
    below, before = np.clip((line - z) / 9 + 0.4, 0, 1), np.clip((ear[1] + 4 - y) / 8, 0, 1)
    soft = below * before * np.clip((z - jaw) / 14 + 0.5, 0, 1)
    # on either side below the lower lip
    bare = 0.55 * np.exp(-0.5 * ((x - 15) / 5) ** 2 - 0.5 * ((z - corner[2] + 15) / 4) ** 2)
    return (soft * (1 - bare) * (1 - np.clip(1.5 * regions(on)["lips"], 0, 1))).astype(np.float32)


def _moustache(on: Canvas) -> np.ndarray:
    """Return the region's part above the mouth and at its corners, [N]."""
    x, z, corner = np.abs(on.position[:, 0]), on.position[:, 2], on.landmarks[291]
    return beard_region(on) * np.clip((corner[0] + 7 - x) / 6, 0, 1) * np.clip((z - corner[2] + 1) / 5, 0, 1)


def _sideburns(on: Canvas) -> np.ndarray:
    """Return closeness [N] in [0, 1] to the lines before the ears."""
    lines = [
        on.landmarks[a] + t * (on.landmarks[b] - on.landmarks[a])
        for side in SIDEBURNS
        for a, b in zip(side, side[1:], strict=False)
        for t in np.linspace(0, 1, 6)
    ]
    forward = np.array([0, -9.0, 0])
    square = np.min([((on.position - at - forward) ** 2).sum(1) for at in lines], axis=0)
    return np.exp(-0.5 * square / 9.0**2).astype(np.float32)


def _ways(on: Canvas) -> np.ndarray:
    """Return hair directions [N, 3]: down, and away from the middle below the nose."""
    x = on.position[:, :1]
    moustache = np.clip((on.position[:, 2:] - on.landmarks[0, 2] + 8) / 8, 0, 1) * (np.abs(x) < 34)
    aside = np.tanh(x / 8) * (0.22 + 0.9 * moustache)
    return aside * [1.0, 0, 0] + [0, 0, -1.0] + np.clip(-60 - on.position[:, 2:], 0, 40) / 40 * [0, -0.15, 0]
