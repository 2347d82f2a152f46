# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pores, freckles and moles, strewn by a density per mm^2 and splatted to the texels near them."""

from __future__ import annotations

import numpy as np

from core.geometry.noise import noise

from .canvas import Canvas


def strew(ground: Canvas, density: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw random surface points, float32 [M, 3] in mm, and the ground's texel under each, int [M].

    `density` [N] is in points per mm^2 on `ground`: one canvas for all sizes, so that marks stay in place at any size.
    """
    expected = np.cumsum(np.asarray(density, np.float64) * ground.area)
    texel = np.searchsorted(expected, rng.uniform(0, expected[-1], rng.poisson(expected[-1])), side="right")
    texel = np.minimum(texel, len(expected) - 1)
    row, column = np.nonzero(ground.covered)
    row, column = row[texel], column[texel]
    right = ground.bled_position[row, np.minimum(column + 1, ground.size - 1)]
    below = ground.bled_position[np.minimum(row + 1, ground.size - 1), column]
    here, share = ground.position[texel], rng.uniform(-0.5, 0.5, (len(texel), 2, 1)).astype(np.float32)
    steps = np.stack([right - here, below - here], 1)
    steps[np.linalg.norm(steps, axis=-1) > 3 * np.sqrt(ground.area[texel])[:, None] + 0.1] = 0  # across a seam
    return here + (steps * share).sum(1), texel


def splat_spots(on: Canvas, points: np.ndarray, radius: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Draw bell-shaped spots, float32 [N]; the strongest counts where they overlap.

    points [M, 3] and radius [M] in mm, spots end at twice that; strength [M] in the middle. A radius below the texel's
    size becomes that size, and the strength is lowered by the same share of area.
    """
    out = np.zeros(len(on.position), np.float32)
    wide = np.maximum(radius, 0.6 * on.texel_mm)
    texel, point, distance = on.near(points, 2 * wide)
    bell = (1 - (distance / (2 * wide[point])) ** 2) ** 2
    np.maximum.at(out, texel, (bell * (strength * (radius / wide) ** 2)[point]).astype(np.float32))
    return out


def splat_moles(
    on: Canvas,
    points: np.ndarray,
    radius: np.ndarray,
    darkness: np.ndarray,
    height: np.ndarray,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw flat stains with a ragged edge, and domes, float32 [N] each.

    points [M, 3] and radius [M] in mm; darkness of the stains, within their grain, and height of the domes in the
    middle, [M].
    """
    stain, dome = np.zeros((2, len(on.position)), np.float32)
    texel, point, distance = on.near(points, radius * 1.6 + 0.3)
    edge = noise(on.position[texel], 1.3, rng, smooth=True) if len(texel) else np.zeros(0)
    softness = 0.25 + 0.25 / np.maximum(radius[point], 0.3)
    inward = np.clip((1 - distance / radius[point] + 0.125 * edge) / softness + 0.3, 0, 1)
    np.maximum.at(stain, texel, (darkness[point] * inward * (1 + 0.12 * edge)).astype(np.float32))
    bow = np.clip(1 - (distance / radius[point]) ** 2, 0, 1)
    np.maximum.at(dome, texel, (height[point] * bow).astype(np.float32))
    return stain, dome
