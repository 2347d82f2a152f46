# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person wears at the neck: a shirt with a round collar or an open one with lapels, and shoulders beneath."""

from __future__ import annotations

import numpy as np

from ...geometry.meshes import Mesh
from ...geometry.noise import octaves
from .person import Person

AROUND = 144
NECK = np.array([0.0, 0.075])  # x and y of the neck's axis, metres
COLLAR_Z = -0.163  # of the shirt's upper edge at the side
PROFILE = (  # radius over the neck's, drop below the edge, and how far the section is the shoulders' (0 round ... 1 wide), in metres
    (0.000, -0.004, 0.0), (0.003, 0.000, 0.0), (0.005, 0.006, 0.0), (0.008, 0.014, 0.0), (0.020, 0.022, 0.15), (0.045, 0.034, 0.45), (0.075, 0.048, 0.75),
    (0.095, 0.070, 0.95), (0.105, 0.120, 1.0), (0.108, 0.200, 1.0), (0.110, 0.300, 1.0))


def shirt(person: Person, head: Mesh) -> Mesh:
    """A ring of cloth around the neck that widens to the shoulders; without UVs."""
    rng = np.random.default_rng([person.seed, 67])
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    radius = _neck(head, turn)
    front = np.clip(-np.sin(turn), 0, 1)  # sin = -1 towards the face
    dip = 0.018 * front**2 if person.collar == "crew" else 0.055 * np.clip((front - 0.75) / 0.25, 0, 1)
    rows = []
    for out, drop, wide in PROFILE:
        reach = radius + out + (0.006 if person.collar == "polo" and drop < 0.015 else 0.0)
        x, y = NECK[0] + reach * np.cos(turn) * (1 + 0.75 * wide), NECK[1] + reach * np.sin(turn) * (1 - 0.15 * wide)
        rows.append(np.stack([x, y, COLLAR_Z - drop - dip * (1 - wide) - 0.05 * wide * np.abs(np.cos(turn)) ** 3 + 0 * turn], -1))
    vertices = np.concatenate(rows)
    folds = octaves(1000 * vertices, [60.0, 30.0], rng, smooth=True)[:, None]
    away = vertices - [*NECK, -0.25]
    vertices = vertices + 0.0035 * folds * np.repeat([min(1.0, p[0] / 0.03) for p in PROFILE], AROUND)[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
    k, r = np.meshgrid(np.arange(AROUND), np.arange(len(PROFILE) - 1))
    a, b = (r * AROUND + k).ravel(), (r * AROUND + (k + 1) % AROUND).ravel()
    return Mesh(vertices, np.concatenate([np.stack([a, a + AROUND, b], 1), np.stack([b, a + AROUND, b + AROUND], 1)]))


def _neck(head: Mesh, turn: np.ndarray) -> np.ndarray:
    """The neck's radius [len(turn)] in metres at the shirt's edge, in each direction around its axis."""
    near = head.vertices[np.abs(head.vertices[:, 2] - COLLAR_Z) < 0.012]
    arm = near[:, :2] - NECK
    at, reach = np.arctan2(arm[:, 1], arm[:, 0]), np.linalg.norm(arm, axis=1)
    apart = np.abs((turn[:, None] - at[None] + np.pi) % (2 * np.pi) - np.pi)
    weight = np.exp(-((apart / 0.15) ** 2))
    return (weight * reach).sum(1) / np.maximum(weight.sum(1), 1e-9) + 0.001
