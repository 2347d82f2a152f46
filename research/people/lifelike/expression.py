# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions of people in the sun: smiles and squints by the built-in head's own face units, lips closed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from core.face import template
from core.face.eye_asset import DATA_FILES

MOODS = {
    "smile": {"mouthSmile": 1.0, "cheekSquint": 0.8, "mouthDimple": 0.3, "mouthStretch": 0.2},
    "squint": {"browDown": 0.9, "cheekSquint": 0.9, "noseSneer": 0.5, "mouthUpperUp": 0.3},
    "frown": {"browDown": 1.0, "mouthFrown": 0.6, "mouthPress": 0.5},
    "raised": {"browInnerUp": 0.8, "browOuterUp": 0.8},
}
"""Units at a mood's full strength."""
NARROWING = {"smile": 0.3, "squint": 0.6, "frown": 0.2, "raised": 0.0}
"""Share by which the lids close at full strength."""


@dataclass(frozen=True)
class Expression:
    """Displacement of the head's vertices [V, 3], metres, and factor on the openness of the lids."""

    moves: np.ndarray
    lids: float


def sample_expression(rng: np.random.Generator) -> Expression:
    """Draw a mood of any strength, a little stronger on one side."""
    mood = str(rng.choice(list(MOODS)))
    strength = rng.uniform(0.3, 1.0)
    moves = np.zeros_like(template.load().vertices)
    for name, share in MOODS[mood].items():
        for moved in _unit(name):
            moves += strength * share * rng.uniform(0.75, 1.15) * moved
    return Expression(moves, 1 - strength * NARROWING[mood])


@cache
def _unit(name: str) -> tuple[np.ndarray, ...]:
    """Return the displacements [V, 3] of a unit's two sides, or of one that has no sides, both halves."""
    count = len(template.load().vertices)
    with np.load(template.ASSETS.parent / DATA_FILES[0], allow_pickle=False) as stored:
        key = name if f"rows_{name}" in stored.files else f"{name}Left"
        rows = np.cumsum(stored[f"rows_{key}"].astype(int))
        moves, mirror = stored[f"moves_{key}"].T * float(stored["step"]), stored["mirror"].astype(int)
    sides = []
    for at, by in ((rows, moves), (mirror[rows], moves * [-1, 1, 1])):
        side = np.zeros((len(mirror), 3))
        side[at] = by
        sides.append(side[:count])
    if key != name:
        return tuple(sides)
    # only half of a symmetric unit is stored, the middle with it
    return (np.where(sides[0] != 0, sides[0], sides[1]),)
