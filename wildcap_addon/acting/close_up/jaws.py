# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Carry shapes from the built-in head's jaws to another head's, at rest and in motion.

Its teeth are two bands: what is defined in the template's axes at rest follows these. Lengths in metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..asset import FaceUnits, load
from . import ball, mouth_shapes

SHOWN_M, FARTHEST_M = 0.001, 0.006
"""Length of the upper teeth below the line of the lips, as most people show, and the most that they are moved for it:
the face carries the bands without regard to where the lips end."""
WIDE_M = 0.009
"""Half the width of the front teeth whose edges are measured."""
LEAST_M = 3e-4
"""Least motion of jaw and tongue: a unit below it moves only the lips."""


@dataclass(frozen=True)
class Jaws:
    """Bands of a head; upper, lower and tongue are their rows within the P inner vertices."""

    asset: FaceUnits
    upper: np.ndarray
    lower: np.ndarray
    tongue: np.ndarray
    rest: np.ndarray  # [P, 3]
    moves: dict[str, np.ndarray]  # [P, 3] of each unit that moves jaw or tongue
    lowered_by: np.ndarray  # [3] from the bands to where the lips show that the teeth are

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Take points [N, 3] of the template to the head at rest."""
        both = np.concatenate([self.upper, self.lower])
        return _affine(self.asset.parts[both], self.rest[both] + self.lowered_by, points)

    def turned(self, unit: str, points: np.ndarray) -> np.ndarray:
        """Return what a unit adds to points [N, 3] of the head that follow the lower teeth."""
        return _affine(self.rest[self.lower], self.moves[unit][self.lower], points)

    def turned_back(self, unit: str, points: np.ndarray) -> np.ndarray:
        """Take points [N, 3] of the head with a unit at 1 to the template."""
        band = self.placed(self.asset.parts[self.lower])
        return _affine(band + self.turned(unit, band), self.asset.parts[self.lower], points)


def find_jaws(obj, shape: mouth_shapes.Mouth) -> Jaws:
    """Return the jaws of a head with face units."""
    asset, keys = load(), obj.data.shape_keys.key_blocks
    upper, lower, tongue = mouth_shapes.bands(asset)
    head = ball.places(keys[0])
    rest = head[asset.first_inner :]
    moves = {name: ball.places(keys[name])[asset.first_inner :] - rest for name in asset.units}
    driven = np.concatenate([lower, tongue])
    moves = {name: moved for name, moved in moves.items() if np.abs(moved[driven]).max() > LEAST_M}
    jaws = Jaws(asset, upper, lower, tongue, rest, moves, np.zeros(3))
    return replace(jaws, lowered_by=_lowering(asset, head, jaws.placed(shape.vertices[~shape.lower])))


def find_edges(shape: mouth_shapes.Mouth, teeth: np.ndarray) -> tuple[float, float]:
    """Return the heights of the upper and the lower front teeth's edges, for teeth and gums at [V, 3]."""
    front = np.abs(teeth[:, 0] - teeth[:, 0].mean()) < WIDE_M
    return float(teeth[front & ~shape.lower, 2].min()), float(teeth[front & shape.lower, 2].max())


def _lowering(asset: FaceUnits, head: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the offset [3] from the carried upper teeth [N, 3] to where the lips of the head at rest meet."""
    lips = asset.copies[asset.seam == 0]
    meet = head[lips[np.abs(asset.template[lips, 0]).argmin()]]
    edge = upper[np.abs(upper[:, 0] - meet[0]) < WIDE_M, 2].min()
    return np.array([0, 0, np.clip(meet[2] - SHOWN_M - edge, -FARTHEST_M, FARTHEST_M)])


def _affine(before: np.ndarray, after: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Apply to points [M, 3] the affine map from places [N, 3] to others, or to displacements."""
    one = np.concatenate([before, np.ones((len(before), 1))], 1)
    return np.concatenate([points, np.ones((len(points), 1))], 1) @ np.linalg.lstsq(one, after, rcond=None)[0]
