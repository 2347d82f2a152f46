# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A shirt with a round or V neck, and the shoulders beneath."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from core.geometry.meshes import Mesh
from core.geometry.noise import octaves

from .person import Person

AROUND = 144
NECK = np.array([0.0, 0.075])  # x and y of the neck's axis, metres
COLLAR_Z = -0.160  # of the shirt's upper edge, higher where the neck is cut off above it
OVER_CUT = 0.008  # that the edge is above the neck's cut
LOWER_THAN_FACE = -0.09
# metres: wider than the neck at the sides, deeper than it, drop at the sides, drop in front and behind
PROFILE = np.array(
    [
        (-0.005, -0.005, 0.030, 0.030),
        (0.000, 0.000, -0.003, -0.003),
        (0.003, 0.003, -0.004, -0.004),
        (0.005, 0.005, 0.002, 0.002),
        (0.006, 0.006, 0.014, 0.014),
        (0.020, 0.015, 0.022, 0.028),
        (0.050, 0.030, 0.036, 0.050),
        (0.090, 0.040, 0.052, 0.080),
        (0.125, 0.046, 0.070, 0.110),
        (0.145, 0.050, 0.100, 0.150),
        (0.150, 0.055, 0.170, 0.220),
        (0.150, 0.055, 0.300, 0.320),
    ]
)
ROWS = 44


def shirt(person: Person, head: Mesh) -> Mesh:
    """Return a ring of cloth around the neck that widens to the shoulders; without UVs."""
    rng = np.random.default_rng([person.seed, 67])
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    front = np.clip(-np.sin(turn), 0, 1)  # sin = -1 towards the face
    edge = np.maximum(
        COLLAR_Z - (0.010 * front**2 if person.collar == "crew" else 0.018 * front**4), _cut(head, turn) + OVER_CUT
    )
    radius = _neck(head, turn, edge)
    at = np.linspace(0, len(PROFILE) - 1, ROWS)
    side, deep, low, ahead = (np.interp(at, np.arange(len(PROFILE)), column)[:, None] for column in PROFILE.T)
    c, s = np.cos(turn), np.sin(turn)
    height = COLLAR_Z - low * c**2 - ahead * s**2 + (edge - COLLAR_Z) * np.clip(1 - at / len(PROFILE), 0, 1)[:, None]
    vertices = np.stack([NECK[0] + (radius + side) * c, NECK[1] + (radius + deep) * s, height], -1).reshape(-1, 3)
    free = np.repeat(np.clip(side / 0.05, 0, 1), AROUND)  # cloth folds where it lies off the neck
    folds = octaves(1000 * vertices, [70.0, 28.0], rng, smooth=True)[:, None] * free[:, None]
    away = vertices - [*NECK, -0.25]
    vertices = vertices + 0.003 * folds * away / np.linalg.norm(away, axis=1, keepdims=True)
    k, r = np.meshgrid(np.arange(AROUND), np.arange(ROWS - 1))
    a, b = (r * AROUND + k).ravel(), (r * AROUND + (k + 1) % AROUND).ravel()
    return Mesh(vertices, np.concatenate([np.stack([a, a + AROUND, b], 1), np.stack([b, a + AROUND, b + AROUND], 1)]))


def _cut(head: Mesh, turn: np.ndarray) -> np.ndarray:
    """Return the height [len(turn)] in metres of the neck's end in each direction around its axis."""
    edges, count = np.unique(np.sort(head.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1), axis=0, return_counts=True)
    rim = head.vertices[np.unique(edges[count == 1])]
    apart, _ = _around(rim[rim[:, 2] < LOWER_THAN_FACE], turn)
    highest = np.where(apart < 0.25, rim[rim[:, 2] < LOWER_THAN_FACE][:, 2], -np.inf).max(1)
    return gaussian_filter1d(np.maximum(highest, rim[:, 2].min()), 3, mode="wrap")


def _neck(head: Mesh, turn: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """Return the neck's radius [len(turn)] in metres at the shirt's edge, of height [len(turn)]."""
    near = head.vertices[head.vertices[:, 2] < edge.max() + 0.03]
    apart, reach = _around(near, turn)
    weight = np.exp(-((apart / 0.12) ** 2) - ((near[:, 2] - edge[:, None]) / 0.007) ** 2) + 1e-12
    return gaussian_filter1d(((weight * reach**8).sum(1) / weight.sum(1)) ** 0.125, 2, mode="wrap") + 0.0015


def _around(points: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angles [len(turn), N] of directions around the neck's axis to points [N, 3], and their distances [N]."""
    arm = points[:, :2] - NECK
    apart = np.abs((turn[:, None] - np.arctan2(arm[:, 1], arm[:, 0])[None] + np.pi) % (2 * np.pi) - np.pi)
    return apart, np.linalg.norm(arm, axis=1)
