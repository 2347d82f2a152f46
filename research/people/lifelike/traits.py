# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Broad pigment of a face: flushed cheeks, nose and ears, tan lines, sallow or ruddy parts.

Such traits are mostly alike on the left and the right: of the variance over the skin a share of SYMMETRIC is that of
the part which mirroring leaves as it is.
"""

from __future__ import annotations

import numpy as np

from core.geometry.noise import octaves

from ..canvas import Canvas
from ..hairs import beard_shadow
from ..regions import regions
from .beards import beard_region
from .person import Person

SYMMETRIC = 0.85, 0.95
WAVELENGTHS_MM = [70.0, 40.0]  # of the noise of which traits are made
FADE_MM = 7.0  # half the width of a tan line


def broad_traits(person: Person, on: Canvas) -> tuple[np.ndarray, np.ndarray]:
    """Draw additions to the logarithms of melanin and of blood, float32 [N] each."""
    rng = np.random.default_rng([person.seed, 62])
    area = regions(on)
    melanin = (
        rng.normal(0, 0.10) * area["forehead"]
        + abs(rng.normal(0, 0.16)) * area["mouth_surround"]
        + rng.normal(0.05, 0.10) * area["cheeks"]
    )
    melanin = melanin + abs(rng.normal(0, 0.12)) * area["sockets"] - person.tan * _shaded(on, rng)
    blood = (
        abs(rng.normal(0, 0.35)) * area["cheeks"]
        + abs(rng.normal(0, 0.45)) * area["nose"]
        + abs(rng.normal(0, 0.4)) * area["ears"]
        + rng.normal(0, 0.2) * area["chin"]
        + rng.normal(0, 0.12) * area["forehead"]
    )
    fields = []
    for field, share in ((melanin, 0.06), (blood, 0.10)):
        noise = on.spread(on.soft(lambda at: octaves(at, WAVELENGTHS_MM, rng, smooth=True)))
        even = ((noise + noise[:, ::-1]) / np.sqrt(2))[on.covered]
        fields.append(_with_sides(field + share * even, on, rng))
    return tuple(fields)


def shaded(person: Person, on: Canvas, diffuse: np.ndarray) -> np.ndarray:
    """Shade the albedo [N, 3] by a shaven beard, which lies below the surface."""
    rng = np.random.default_rng([person.seed, 63])
    uneven = 1 + 0.15 * on.soft(lambda at: octaves(at, [14.0], rng, smooth=True))
    return beard_shadow(diffuse, np.clip(beard_region(on) * 0.8 * person.shade * uneven, 0, 1))


def _shaded(on: Canvas, rng: np.random.Generator) -> np.ndarray:
    """Draw the lack of melanin [N] where a hat, glasses and a collar keep the sun off."""
    position, at = on.position, on.landmarks
    hat = np.clip((position[:, 2] - at[9, 2] - rng.uniform(18, 32)) / FADE_MM, 0, 1)
    glasses = np.zeros(len(position), np.float32)
    for eye in ((33, 133), (263, 362)):
        middle = at[list(eye)].mean(0) + [0, 0, -3]
        reach = np.sqrt((((position - middle) / [26, 60, 19]) ** 2).sum(1))
        glasses = np.maximum(glasses, np.clip((1 - reach) * 19 / FADE_MM + 0.5, 0, 1))
    collar = np.clip((at[152, 2] - rng.uniform(35, 55) - position[:, 2]) / (2 * FADE_MM) + 0.5, 0, 1)
    worn = rng.random(3) < [0.4, 0.35, 0.7]
    return (worn[0] * 0.25 * hat + worn[1] * 0.3 * glasses + worn[2] * 0.45 * collar).astype(np.float32)


def _with_sides(field: np.ndarray, on: Canvas, rng: np.random.Generator) -> np.ndarray:
    """Make the field [N] even, and add as much difference between the sides as SYMMETRIC asks."""
    picture, skin = on.spread(field), on.spread(regions(on)["bald"])
    even = (picture + picture[:, ::-1]) / 2
    odd = on.spread(on.soft(lambda at: octaves(at, WAVELENGTHS_MM, rng, smooth=True)))
    odd = odd - odd[:, ::-1]
    spread = [np.sqrt(np.average((half - np.average(half, weights=skin)) ** 2, weights=skin)) for half in (even, odd)]
    share = rng.uniform(*SYMMETRIC)
    return (even + odd * spread[0] / max(spread[1], 1e-9) * np.sqrt((1 - share) / share))[on.covered].astype(np.float32)
