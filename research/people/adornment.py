# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scars, and make-up on lips, lids, lashes and cheeks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .canvas import Canvas
from .regions import lid_lines, regions
from .spots import splat_spots, strew

# albedo, linear sRGB
LIPSTICKS = np.array(
    [[0.30, 0.02, 0.03], [0.45, 0.10, 0.12], [0.20, 0.01, 0.04], [0.50, 0.16, 0.10], [0.12, 0.02, 0.03]]
)
SHADOWS = np.array([[0.10, 0.06, 0.05], [0.05, 0.04, 0.06], [0.20, 0.11, 0.08], [0.06, 0.07, 0.12], [0.14, 0.08, 0.11]])


class Scars(NamedTuple):
    """Effect of scars, float32 [N]: on the logarithms of melanin (stain) and blood (flush), on height in mm (ridge)."""

    stain: np.ndarray
    flush: np.ndarray
    ridge: np.ndarray


def paint_scars(on: Canvas, ground: Canvas, expected: float, rng: np.random.Generator) -> Scars:
    """Draw scars: thin lines of 4 to 20 mm on bare face and neck, old pale ones and young red ones.

    They begin on `ground`, GROUND texels wide, of the same head; `expected` is their mean number.
    """
    room = regions(ground)["bald"] * (1 - regions(ground)["ears"])
    begins, texel = strew(ground, expected * room / float((ground.area * room).sum()), rng)
    stain, flush, ridge = np.zeros((3, len(on.position)), np.float32)
    for begin, normal in zip(begins, ground.normal[texel], strict=True):
        way = np.cross(normal, rng.normal(size=3))
        along = np.linspace(0, 1, 60)[:, None]
        bow = np.cross(normal, way) * 4 * along * (1 - along) * rng.normal(0, 0.12)
        line = begin + (along * way + bow) * rng.uniform(4, 20) / max(np.linalg.norm(way), 1e-6)
        _, nearest = on.tree.query(line)  # lays it onto the surface
        line, width = on.position[nearest], rng.uniform(0.3, 0.9)
        mark = splat_spots(on, line, width * np.sin(np.linspace(0.15, np.pi - 0.15, len(line))), np.ones(len(line)))
        young = rng.random() ** 2
        stain -= mark * (0.8 - 0.5 * young) * np.float32(rng.uniform(0.5, 1.2))
        flush += mark * np.float32(1.4 * young - 0.3)
        ridge += mark * np.float32(rng.normal(0, 0.12))
    return Scars(stain, flush, ridge)


def put_on_make_up(diffuse: np.ndarray, on: Canvas, amount: float, rng: np.random.Generator) -> np.ndarray:
    """Paint lipstick, eye shadow, liner and blusher, each worn or not, on the linear albedo [N, 3] of a canvas.

    amount in [0, 1]: maximum strength.
    """
    if amount <= 0:
        return diffuse
    area = regions(on)
    worn = amount * (rng.random(4) < [0.8, 0.5, 0.5, 0.6]) * rng.uniform(0.4, 1.0, 4)
    light = diffuse.mean() / 0.25  # the colours are for middling skin
    lipstick = LIPSTICKS[rng.integers(len(LIPSTICKS))] * light**0.3
    shadow = SHADOWS[rng.integers(len(SHADOWS))] * light**0.6
    out = _coat(diffuse, lipstick, 0.9 * worn[0] * np.clip(area["lips"] * 1.3, 0, 1))
    out = _coat(out, shadow, 0.6 * worn[1] * np.clip(area["eyelids"] + 0.5 * area["sockets"], 0, 1))
    out = _coat(out, np.array([0.015, 0.012, 0.012]), 0.9 * worn[2] * _lid_line(on))
    return out * (1 - worn[3] * area["cheeks"][:, None] * np.array([0.05, 0.28, 0.22])).astype(np.float32)


def _lid_line(on: Canvas) -> np.ndarray:
    """Return closeness [N] in [0, 1] to the line where the lids meet: 1 on it, 0 from about 2 mm on."""
    if "lid line" not in on.cache:
        lids = lid_lines(on)
        on.cache["lid line"] = splat_spots(on, lids, np.full(len(lids), 1.0), np.ones(len(lids)))
    return on.cache["lid line"]


def _coat(below: np.ndarray, colour: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Cover `below` [N, 3] with a thin coat of `colour` [3], through which pores and creases show."""
    middle = max(float(np.average(below.mean(-1), weights=cover + 1e-6)), 1e-4)
    relief = np.clip(below.mean(-1, keepdims=True) / middle, 0.5, 1.5)
    return (below * (1 - cover[:, None]) + colour * relief * cover[:, None]).astype(np.float32)
