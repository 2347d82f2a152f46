# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Markings beyond the plausible, as logarithms of albedo factors: a delighter must not take them for light."""

from __future__ import annotations

import cv2
import numpy as np

HARD = 0.3  # of a stain's softness, from 0.02 to 1: below, its edge is as sharp as a cast shadow's may be


def stains(side: int, rng: np.random.Generator) -> np.ndarray:
    """Draw patches of another colour [S, S, 3] as logarithms: port-wine stains, vitiligo, paint.

    Those with a hard edge are dyes, which leave one colour channel as it is: a grey patch with a hard edge looks like a
    leaf's shadow.
    """
    count = int(rng.integers(3, 14))
    field = cv2.resize(rng.normal(0, 1, (count, count)).astype(np.float32), (side, side), interpolation=cv2.INTER_CUBIC)
    softness = np.exp(rng.uniform(np.log(0.02), np.log(1.0)))
    where = np.clip(0.5 + (field - rng.uniform(0.0, 1.2)) / softness, 0, 1)
    colour = rng.normal(-0.25, 0.45) + rng.normal(0, 0.25, 3)
    if softness < HARD:
        colour[rng.integers(3)] = 0
    return where[..., None] * colour.astype(np.float32)


def moles(side: int, rng: np.random.Generator) -> np.ndarray:
    """Draw dark and light spots [S, S, 3] of all sizes as logarithms."""
    log = np.zeros((side, side, 3), np.float32)
    for _ in range(int(rng.integers(2, 40))):
        spot = np.zeros((side, side), np.uint8)
        at, radius = rng.uniform(0.1, 0.9, 2) * side, np.exp(rng.uniform(np.log(0.5), np.log(6.0)))
        axes, middle = (
            (radius * np.exp(rng.normal(0, 0.2, 2)) * 16).astype(int).tolist(),
            (at * 16).astype(int).tolist(),
        )
        cv2.ellipse(spot, middle, axes, float(rng.uniform(0, 180)), 0, 360, 255, -1, cv2.LINE_AA, 4)
        tint = rng.normal(-0.5, 0.4) + rng.normal(0, 0.1, 3)
        log += (spot.astype(np.float32) / 255)[..., None] * tint.astype(np.float32)
    return np.clip(log, -1.6, 1.0)


def tufts(side: int, landmarks: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw tufts of short hairs anywhere on a face [S, S, 3] as logarithms: brows where no brow is."""
    log = np.zeros((side, side, 3), np.float32)
    low, high = landmarks.min(0), landmarks.max(0)
    face = float((high - low).max())
    for _ in range(int(rng.integers(1, 6))):
        middle, turn = rng.uniform(low, high), rng.uniform(0, np.pi)
        half = face * np.exp(rng.uniform(np.log(0.03), np.log(0.16))) * np.array([1.0, rng.uniform(0.12, 0.7)])
        strands, width = np.zeros((side, side), np.uint8), max(1, round(side / 256))
        comb, length = rng.uniform(0, np.pi), face * rng.uniform(0.015, 0.05)
        count = int(np.clip(4 * half[0] * half[1] * rng.uniform(0.15, 1.2), 6, 1500))
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        roots = middle + (rng.normal(0, 0.5, (count, 2)).clip(-1, 1) * half) @ axes
        ways = comb + rng.normal(0, 0.3, count)
        ends = roots + length * np.stack([np.cos(ways), np.sin(ways)], 1)
        lines = [np.round(16 * np.stack(pair)).astype(np.int32) for pair in zip(roots, ends, strict=True)]
        cv2.polylines(strands, lines, False, 255, width, cv2.LINE_AA, 4)
        colour = rng.normal(-0.9, 0.5) + rng.normal(0, 0.12, 3)
        soft = cv2.GaussianBlur(strands, (0, 0), rng.uniform(0.3, 1.2)).astype(np.float32)
        log += (soft / 255)[..., None] * colour.astype(np.float32)
    return np.clip(log, -2.2, 1.2)
