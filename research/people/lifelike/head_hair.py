# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of the head: cropped, short with or without a fringe, long over the ears to the shoulders."""

from __future__ import annotations

import numpy as np

from core.face.strands import SkinSurface, Strands, clumped, coloured, grow, waved
from core.geometry.meshes import unit
from core.geometry.noise import octaves

from ..canvas import Canvas
from ..regions import regions
from .ground import Ground, strew_roots
from .person import Person

COUNT = {"cropped": 34000, "short": 26000, "long": 24000}  # hairs
# fewer hairs than people have, each a little thicker
RADIUS_M = {"cropped": 0.00006, "short": 0.00008, "long": 0.00010}
STEPS = {"cropped": 4, "short": 10, "long": 20}  # segments of a hair
WAVE_M = {"cropped": 0.0008, "short": 0.004, "long": 0.006}  # of fully curled hair
CROWN_MM = np.array([8.0, 120.0, 95.0])
NAPE_MM, BEHIND_MM = -72.0, 100.0  # below the nape, and below the ears before them, grows nothing
FRINGE_MM = 56.0  # half the width of a fringe of long hair
AXIS = np.array([0.0, 0.075])  # x and y about which long hair hangs, metres
# half the width and depth beyond which it is drawn in, and the share by which single hairs may pass them
GATHER = 0.092, 0.125, 0.12
SIDEBURN_MM = 34.0, 56.0, -6.0, 40.0  # front, back, bottom and top of the hair before the ears
# half the width of the face and the depth (y) before which long hair does not hang, metres
FACE = np.array([0.066, 0.026])


def scalp_density(on: Canvas, seed: int) -> np.ndarray:
    """Return head hair's density [N] in [0, 1]: the scalp with an uneven hairline, down to the nape."""
    rng = np.random.default_rng([seed, 66])
    ragged = on.soft(lambda at: octaves(at, [22.0, 10.0], rng, smooth=True))
    soft = np.clip(regions(on)["scalp"] * 2.2 - 0.75 + 0.15 * ragged, 0, 1)
    behind_ears = np.clip((on.position[:, 1] - np.interp(on.position[:, 2], [-30, -12], [BEHIND_MM, -100])) / 8, 0, 1)
    scalp = soft * behind_ears * np.clip((on.position[:, 2] - NAPE_MM) / 10, 0, 1)
    return np.maximum(scalp, (0.8 + 0.15 * ragged) * _before_the_ears(on)).clip(0, 1)


def _before_the_ears(on: Canvas) -> np.ndarray:
    """Return the region [N] in [0, 1] of head hair between temple and ear."""
    x, y, z = on.position.T
    band = np.clip((y - SIDEBURN_MM[0]) / 5, 0, 1) * np.clip((SIDEBURN_MM[1] - y) / 4, 0, 1) * (np.abs(x) > 50)
    above, below = np.clip((z - SIDEBURN_MM[2]) / 8, 0, 1), np.clip((SIDEBURN_MM[3] - z) / 8, 0, 1)
    return band * above * below * (1 - regions(on)["ears"])


def grow_head_hair(person: Person, ground: Ground, skin: SkinSurface, rng: np.random.Generator) -> Strands:
    """Grow cropped, short or long hair; long hair hangs beside the face and lies on the shoulders.

    The person's hair is not "none"; hairs stay out of `skin`, clothes included.
    """
    on, style = ground.canvas, person.hair
    density = scalp_density(on, person.seed)
    density = density * COUNT[style] / float((density * on.area).sum())
    roots = strew_roots(ground, density, _ways(on, person), 0.15, rng)
    count, front = len(roots.at), _front(roots.at)
    length = person.hair_length * rng.uniform(0.75, 1.1, count)
    clearance = rng.uniform(0.0005, 1.0, count)
    if style == "cropped":
        length = length * np.interp(roots.at[:, 2], [-60, 70], [0.45, 1.0])  # shorter at the sides
        lift, pull, above = rng.normal(0.75, 0.15, count).clip(0.2), -0.3 * roots.normal, 0.25 * length
    elif style == "short":
        length = length * np.interp(roots.at[:, 2], [-70, 20, 80], [0.22, 0.5, 1.0])
        if person.fringe:
            length = np.where(front > 0.4, np.minimum(1.25 * length, _to_brows(roots.at)), length)
        # bends down, the fringe more
        pull, above = np.array([0, 0, -1.0]) * (0.55 + (0.9 - 0.55) * front)[:, None], 0.001 + 0.24 * clearance * length
        lift = rng.normal(0.55, 0.12, count).clip(0.1)
    else:
        fringe = (front > 0.4) & (np.abs(roots.at[:, 0]) < FRINGE_MM) & person.fringe
        length = np.where(fringe, np.minimum(length, _to_brows(roots.at)), length)
        pull, above = np.where(fringe[:, None], [0, 0.1, -1.2], [0, 0.15, -3.6]), 0.002 + 0.007 * clearance
        lift = rng.normal(0.3, 0.08, count).clip(0.05)
    points = grow(roots, length, lift, skin, pull, above, STEPS[style])
    if style == "long":
        points = np.where(fringe[:, None, None], points, _beside_the_face(points))
    points = waved(points, roots.at, person.curl * WAVE_M[style], 14.0, rng, 0.2)
    if style != "cropped":
        points = clumped(points, 26, 0.55, rng)
        points = clumped(points, 8, 0.35, rng)
    if style == "long":
        points = _gathered(points)
    colour = coloured(count, np.asarray(person.hair_colour), person.grey, rng)
    return Strands(points, np.full(count, RADIUS_M[style], np.float32), colour, "hair")


def _gathered(points: np.ndarray) -> np.ndarray:
    """Draw in long hair [M, K, 3] that stands far off below the ears' tops; what lies on the shoulders stays."""
    x, y, z = np.moveaxis(points.astype(np.float64), -1, 0)
    across = np.stack([x, y - AXIS[1]], -1)
    reach = np.linalg.norm(across / GATHER[:2], axis=-1)
    hangs = np.clip((0.04 - z) / 0.04, 0, 1) * np.clip((z + 0.15) / 0.05, 0, 1)
    over = np.maximum(reach - 1, 0)
    factor = np.where(over > 0, (1 + GATHER[2] * np.tanh(over / GATHER[2])) / np.maximum(reach, 1e-9), 1)
    scale = 1 + hangs * (factor - 1)
    return np.stack([x * scale, AXIS[1] + across[..., 1] * scale, z], -1).astype(np.float32)


def _ways(on: Canvas, person: Person) -> np.ndarray:
    """Return the combing direction [N, 3]: from the crown outwards, from the parting aside, or forward."""
    away = unit(on.position - CROWN_MM)
    front = _front(on.position)[:, None]
    side = np.tanh((on.position[:, :1] - 1000 * person.parting) / 6) * [1.0, 0, 0]
    if person.hair == "long":
        top = np.clip((on.position[:, 2:] - 40) / 30, 0, 1)
        combed = side + [0, 0.35, -0.3]
        way = away * (1 - top) + combed * top
        return way * (1 - front) + [0, -1.0, -0.6] * front if person.fringe else way
    if person.fringe:
        return away + front * ([0.25, -0.9, -0.4] + 0.3 * side)
    swept = np.sign(person.parting or 0.5) * np.array([0.9, 0, 0.0]) + [0, 0.4, 0.3]
    return away * (1 - front) + swept * front


def _front(at: np.ndarray) -> np.ndarray:
    """Return the share [N] to which places [N, 3] in mm belong to the hair over the forehead."""
    return np.clip((50 - at[:, 1]) / 30, 0, 1) * np.clip((at[:, 2] - 45) / 15, 0, 1)


def _to_brows(at: np.ndarray) -> np.ndarray:
    """Return the length [N] in metres of a fringe that ends above the brows."""
    return np.clip(1.25 * (at[:, 2] - 26) + 0.8 * np.clip(at[:, 1] + 20, 0, 60), 8, 90) / 1000


def _beside_the_face(points: np.ndarray) -> np.ndarray:
    """Move long hair [M, K, 3] that would hang before the face beside and behind its rim."""
    x, y, z = np.moveaxis(points, -1, 0)
    below = np.clip((0.055 - z) / 0.03, 0, 1)
    inside = np.clip((FACE[1] - y) / 0.01, 0, 1) * below
    aside = np.where(x < 0, -1, 1) * np.maximum(np.abs(x), FACE[0] + 0.006 * np.abs(np.sin(700 * x)))
    behind = np.maximum(y, FACE[1] - 0.008)
    places = [x * (1 - inside) + aside * inside, y * (1 - inside) + behind * inside, z]
    return np.stack(places, -1).astype(np.float32)
