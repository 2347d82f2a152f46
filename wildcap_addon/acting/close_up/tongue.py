# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Place the close-up's tongue: within the lower teeth wherever the jaw goes, and down between them in an open mouth.

Behind closed lips a tongue reaches up to the palate. Its tip follows the jaw, its root the hyoid bone: an opening jaw
does not turn the whole tongue, or its back would stand in front of the throat. Lengths in metres.
"""

from __future__ import annotations

import numpy as np
from mathutils.bvhtree import BVHTree

from ..asset import FaceUnits, lining
from . import ball
from .jaws import Jaws, find_edges
from .mouth_shapes import Mouth, lower_arch

OPEN, OUT = "jawOpen", "tongueOut"
OVER, DOWN = "tongueOver", "tongueDown"
"""Keys that are no units: the rise of the tip on its way out, and the descent as the jaw opens."""
OUT_BY = f"min({OUT}, {OPEN})"
"""Share by which the tongue comes out: closed lips stop it."""
LED_BY = {
    OUT: OUT_BY,
    OVER: f"4 * {OUT_BY} * (1 - {OUT_BY})",
    DOWN: f"min({OPEN}, 1) * (2 - min({OPEN}, 1)) * (1 - min(4 * {OUT}, 1))",
}
"""Expressions of units that drive these keys. Three quarters of the descent are done when the jaw is half open; a
tongue that is put out rises first, over the lower teeth."""
RISE_M, OVER_M = 0.004, 0.006
"""Height of the tip above the unit's when the tongue is out, and on its way over lower teeth and lip."""
SHARE = 0.5
"""Height of the tongue's back with the jaw fully open, between the edges of the lower and the upper front teeth."""
CLEAR_M = 0.0007
"""Gap between the tongue and lower teeth, gums and floor."""
DEEPEST = 0.85
"""Largest share of the way to the floor that a vertex goes, so that the tongue keeps some thickness."""
WIDTHS = np.linspace(1, 0.6, 9)
"""Shares of its width that the tongue may take where the floor's sides are high."""
NEAR_M = 0.003
"""Distance, along the arch or the tongue and in height, within which points count as beside or above each other: less
than the width of a tooth."""
BEHIND_M = 0.010
"""Distance behind the last teeth over which the tongue regains its width."""


def lay_tongue(obj, jaws: Jaws, shape: Mouth) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the tongue's vertices at rest in a head [N, 3], and what each key adds to them [N, 3]."""
    asset = jaws.asset
    at_rest = jaws.placed(_within_teeth(asset, shape, asset.parts[jaws.tongue]))
    moves = {name: jaws.turned(name, at_rest) for name in jaws.moves} | _out(jaws.moves[OUT][jaws.tongue])
    opened = at_rest + moves[OPEN]
    teeth = jaws.placed(shape.vertices)
    teeth = teeth + shape.lower[:, None] * jaws.turned(OPEN, teeth)
    floor = _lining(asset, ball.places(obj.data.shape_keys.key_blocks[OPEN]))
    down = _laid_down(opened, find_edges(shape, teeth), floor)
    down = jaws.placed(_within_teeth(asset, shape, jaws.turned_back(OPEN, down)))
    return at_rest, moves | {DOWN: down + jaws.turned(OPEN, down) - opened}


def _out(moved: np.ndarray) -> dict[str, np.ndarray]:
    """Return the keys that put the tongue out, from what the unit adds [N, 3]; OVER acts half way only."""
    ahead = np.clip(-moved[:, 1:2], 0, None)
    up = ahead / ahead.max() * [0, 0, 1.0]
    return {OUT: moved + RISE_M * up, OVER: OVER_M * up}


def _within_teeth(asset: FaceUnits, shape: Mouth, points: np.ndarray) -> np.ndarray:
    """Draw points [N, 3] of the tongue in where they touch lower teeth or gums, in the template's axes."""
    arch, teeth = lower_arch(asset), shape.vertices[shape.lower]
    along, inwards, behind, out = arch.beside(points)
    teeth_along, teeth_inwards, _, _ = arch.beside(teeth)
    beside = (np.abs(along[:, None] - teeth_along) < NEAR_M) & (np.abs(points[:, None, 2] - teeth[:, 2]) < NEAR_M)
    least = np.where(beside, teeth_inwards, -np.inf).max(1) + CLEAR_M
    missing = np.clip(least - inwards, 0, None) * np.clip(1 - behind / BEHIND_M, 0, 1)
    return points - missing[:, None] * out


def _laid_down(opened: np.ndarray, edges: tuple[float, float], floor: BVHTree) -> np.ndarray:
    """Return the places [N, 3] of a tongue with the jaw fully open.

    opened: where it would be if it followed the jaw as the teeth do; edges: heights of the upper and the lower front
    teeth's edges; floor: the mouth's lining.
    """
    upper, lower = edges
    column = np.abs(opened[:, None, 1] - opened[None, :, 1]) < NEAR_M  # [N, N] above each other
    back = np.where(column, opened[None, :, 2], -np.inf).max(1)
    height = np.clip(back - lower, 0, None)
    by = height * np.clip(1 - SHARE * (upper - lower) / max(height.max(), CLEAR_M), 0, 1)
    places = _narrowed(opened, column, back - by - CLEAR_M, floor)
    by = np.minimum(by, DEEPEST * (places[:, 2] - _heights(floor, places) - CLEAR_M))
    return places - np.clip(by, 0, None)[:, None] * [0, 0, 1.0]


def _narrowed(places: np.ndarray, column: np.ndarray, most: np.ndarray, floor: BVHTree) -> np.ndarray:
    """Draw the sides of places [N, 3] in to where the floor is below `most` [N]."""
    middle, offset = places.mean(0) * [1, 0, 0], places - places.mean(0) * [1, 0, 0]
    fits = np.array([_heights(floor, middle + offset * [share, 1, 1]) < most for share in WIDTHS])  # [W, N]
    fits = (fits[:, None] | ~column).all(2)
    share = WIDTHS[np.where(fits.any(0), fits.argmax(0), -1)]
    share = (column * share).sum(1) / column.sum(1)
    return middle + offset * np.stack([share, np.ones_like(share), np.ones_like(share)], 1)


def _heights(floor: BVHTree, places: np.ndarray) -> np.ndarray:
    """Return the floor's height below places [N, 3]; -inf where there is none."""
    hits = [floor.ray_cast(place, (0, 0, -1))[0] for place in places.tolist()]
    return np.array([-np.inf if hit is None else hit.z for hit in hits])


def _lining(asset: FaceUnits, places: np.ndarray) -> BVHTree:
    """Return the insides of the cheeks and the mouth's floor, for a head's vertices [V + C + P, 3]."""
    rows = asset.first_inner + lining(asset)
    inside = np.isin(asset.faces[:, :3], rows).any(1)
    faces = [face for face, is_inside in zip(asset.inner_faces(), inside, strict=True) if is_inside]
    return BVHTree.FromPolygons(places.tolist(), faces)
