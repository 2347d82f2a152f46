# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the jaws of the built-in head lie and move in another one. Its teeth are two bands there: what is told in the
template's axes, at rest, goes along with these. Lengths in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..asset import FaceUnits, load
from . import ball, mouth_shapes

SHOWN_M, FARTHEST_M = 0.001, 0.006
"""How far the upper teeth end below where the lips meet, as most people's do, and how far they are moved for it at
most: the bands of the built-in head are carried by the face around them, which knows nothing of where lips end."""
WIDE_M = 0.009
"""Half the width of the front teeth that are looked at for their edges."""
LEAST_M = 3e-4
"""A unit that moves jaw and tongue by less moves the lips alone."""


@dataclass(frozen=True)
class Jaws:
    """upper, lower, tongue: rows of the two bands and of the tongue among the inner vertices. rest, moves: these [P, 3]
    in the head, and what each unit that moves the jaw or the tongue adds to them [P, 3]. lowered_by [3]: from there to
    where the lips tell that the teeth are."""

    asset: FaceUnits
    upper: np.ndarray
    lower: np.ndarray
    tongue: np.ndarray
    rest: np.ndarray
    moves: dict[str, np.ndarray]
    lowered_by: np.ndarray

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Points [N, 3] of the template in the head at rest."""
        both = np.concatenate([self.upper, self.lower])
        return _affine(self.asset.parts[both], self.rest[both] + self.lowered_by, points)

    def turned(self, unit: str, points: np.ndarray) -> np.ndarray:
        """What a unit adds to points [N, 3] of the head that go along with the lower teeth."""
        return _affine(self.rest[self.lower], self.moves[unit][self.lower], points)

    def turned_back(self, unit: str, points: np.ndarray) -> np.ndarray:
        """The template's points for those that lie at [N, 3] in a head whose jaw has followed a unit."""
        band = self.placed(self.asset.parts[self.lower])
        return _affine(band + self.turned(unit, band), self.asset.parts[self.lower], points)


def find_jaws(obj, shape: mouth_shapes.Mouth) -> Jaws:
    """The jaws of a head that has its units."""
    asset = load()
    upper, lower, tongue = mouth_shapes.bands(asset)
    first = len(asset.template) + len(asset.copies)
    keys = obj.data.shape_keys.key_blocks
    head = ball.places(keys[0])
    rest = head[first:]
    moves = {name: ball.places(keys[name])[first:] - rest for name in asset.units}
    moves = {
        name: moved for name, moved in moves.items() if np.abs(moved[np.concatenate([lower, tongue])]).max() > LEAST_M
    }
    jaws = Jaws(asset, upper, lower, tongue, rest, moves, np.zeros(3))
    return replace(jaws, lowered_by=_lowering(asset, head, jaws.placed(shape.vertices[~shape.lower])))


def find_edges(shape: mouth_shapes.Mouth, teeth: np.ndarray) -> tuple[float, float]:
    """Heights of the upper front teeth's edges and of the lower ones', of teeth and gums at [V, 3]."""
    front = np.abs(teeth[:, 0] - teeth[:, 0].mean()) < WIDE_M
    return float(teeth[front & ~shape.lower, 2].min()), float(teeth[front & shape.lower, 2].max())


def _lowering(asset: FaceUnits, head: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The way [3] from where the upper teeth [N, 3] were carried to where the lips of the head at rest meet before
    them."""
    lips = asset.copies[asset.seam == 0]
    meet = head[lips[np.abs(asset.template[lips, 0]).argmin()]]
    edge = upper[np.abs(upper[:, 0] - meet[0]) < WIDE_M, 2].min()
    return np.array([0, 0, np.clip(meet[2] - SHOWN_M - edge, -FARTHEST_M, FARTHEST_M)])


def _affine(before: np.ndarray, after: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where the affine map that takes places [N, 3] to others (or to displacements) takes points [M, 3]."""
    one = np.concatenate([before, np.ones((len(before), 1))], 1)
    return np.concatenate([points, np.ones((len(points), 1))], 1) @ np.linalg.lstsq(one, after, rcond=None)[0]
