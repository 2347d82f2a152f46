# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in the texture: brows of single strokes, stubble with its blue shadow, a cropped scalp."""

from __future__ import annotations

import numpy as np

from core.geometry.noise import octaves

from .canvas import Canvas
from .spots import strew


def grow_brows(on: Canvas, ground: Canvas, region: np.ndarray, density: float, rng: np.random.Generator) -> np.ndarray:
    """Draw brow hair; return its cover [N] in [0, 1] on `on`.

    Hairs root on `ground`, of the same head, within region [M] in [0, 1]; density 1 is usual.
    """
    # a sparse brow is a narrow one
    roots, texel = strew(ground, 1.2 * density * np.clip(region * 2.2 - 1.3 + 0.8 * min(density, 1.2), 0, 1), rng)
    outer = np.abs(roots[:, 0:1]) / np.abs(ground.landmarks[[70, 300], 0]).mean()  # 0 at the nose ... 1 at the tail
    # near the nose hairs stand up, then lie along the brow, and at the tail point down
    rise = np.clip(1.6 - 2.3 * outer, -0.3, 1.3) + rng.normal(0, 0.2, outer.shape)
    normal = ground.normal[texel]
    direction = np.sign(roots[:, 0:1]) * _along(normal, [1.0, 0, 0]) + rise * _along(normal, [0, 0, 1.0])
    return _strokes(on, roots, direction, rng.uniform(4.5, 8, len(roots)), 0.11, np.full(len(roots), -0.25), rng)


def grow_stubble(
    on: Canvas, ground: Canvas, region: np.ndarray, density: float, length: float, rng: np.random.Generator
) -> np.ndarray:
    """Draw beard hair; return its cover [N] in [0, 1] on `on`.

    Hairs root on `ground` within region [M] in [0, 1]; density in hairs per mm^2; length in mm, 0.3 a day after
    shaving.
    """
    roots, texel = strew(ground, density * np.clip(region * 1.3 - 0.15, 0, 1) ** 1.5, rng)
    aside = np.sign(roots[:, 0:1]) * 0.25 + rng.normal(0, 0.35, (len(roots), 1))
    down = aside * _along(ground.normal[texel], [1.0, 0, 0]) - _along(ground.normal[texel], [0, 0, 1.0])
    return _strokes(on, roots, down, length * rng.uniform(0.4, 1.3, len(roots)), 0.06, np.zeros(len(roots)), rng)


def beard_shadow(albedo: np.ndarray, amount: np.ndarray) -> np.ndarray:
    """Shade albedo [N, 3] by hair below the surface, amount [N] in [0, 1]; red reaches deeper and loses more."""
    return albedo * (1 - amount[:, None] * np.array([0.42, 0.30, 0.22], np.float32))


def grow_cropped_hair(on: Canvas, region: np.ndarray, density: float, rng: np.random.Generator) -> np.ndarray:
    """Draw very short scalp hair; return its cover [N] in [0, 1].

    region [N] in [0, 1]; density: mean cover in the full of the region.
    """
    cover, there = np.zeros_like(region), region > 0.01
    grain = octaves(on.position[there], [0.6, 1.1], rng)
    patchy = octaves(on.position[there], [9.0], rng)
    cover[there] = np.clip(region[there] ** 1.5 * density * (1 + 0.20 * grain + 0.05 * patchy), 0, 1)
    return cover


def _along(normal: np.ndarray, way: list[float]) -> np.ndarray:
    """Return the unit direction nearest to `way` [3] in the plane across each normal [M, 3]."""
    flat = np.asarray(way) - (normal @ np.asarray(way))[:, None] * normal
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-3)


def _strokes(
    on: Canvas,
    roots: np.ndarray,
    direction: np.ndarray,
    length: np.ndarray,
    width: float,
    bend: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the cover [N] of straight hairs laid onto the surface.

    They are `width` mm thick, length [M] mm long, run from roots [M, 3] along direction [M, 3] and sink by `bend` (a
    share of the length).
    """
    cover = np.zeros(len(on.position), np.float32)
    if not len(roots):
        return cover
    finest = 0.55 * on.texel_mm
    step = max(0.12, finest)
    count = np.maximum(1, np.ceil(length / step).astype(int))
    hair = np.repeat(np.arange(len(roots)), count)
    along = (np.arange(len(hair)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[hair]
    direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    points = roots[hair] + direction[hair] * (along * length[hair])[:, None]
    points[:, 2] += bend[hair] * along**2 * length[hair]
    _, nearest = on.tree.query(points, distance_upper_bound=8.0)  # lays the straight hair onto the surface
    near = nearest < len(cover)
    hair, along, lifted = hair[near], along[near], points[near] - on.position[nearest[near]]
    on_surface = on.position[nearest[near]] + np.clip(lifted, -finest, finest)
    radius = max(width, finest)
    texel, point, distance = on.near(on_surface, np.full(len(on_surface), 1.5 * radius))
    taper = (1 - 0.7 * along[point] ** 2) * rng.uniform(0.6, 1.0, len(roots))[hair[point]]
    # each hair counts once per texel: the strongest of its samples, then hairs cover each other
    share = np.clip(1 - distance / (1.5 * radius), 0, 1) * taper * min(1.0, 2 * width / radius)
    order = np.lexsort((-share, texel, hair[point]))
    key = hair[point][order].astype(np.int64) * len(cover) + texel[order]
    strongest = order[np.diff(key, prepend=-1) != 0]
    log_bare = np.zeros(len(cover), np.float64)
    np.add.at(log_bare, texel[strongest], np.log1p(-np.minimum(share[strongest], 0.95)))
    return (1 - np.exp(log_bare)).astype(np.float32)
