# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the close-up's tongue lies: within the lower teeth, with which it goes wherever the jaw does, and down
between them when the mouth is open.

Behind closed lips a tongue reaches up to the palate. Its tip keeps to the jaw, its root to the hyoid bone: an opening
jaw does not turn the whole tongue along, or its back would stand before the throat. Lengths in metres.
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
"""Keys that are no units: the rise of the tip on its way out, and what lays the tongue down as the jaw opens."""
OUT_BY = f"min({OUT}, {OPEN})"
"""Through closed lips no tongue comes: it goes as far as the jaw is open."""
LED_BY = {
    OUT: OUT_BY,
    OVER: f"4 * {OUT_BY} * (1 - {OUT_BY})",
    DOWN: f"min({OPEN}, 1) * (2 - min({OPEN}, 1)) * (1 - min(4 * {OUT}, 1))",
}
"""Expressions of units that drive these keys. The tongue leaves the palate as the jaw begins to open: three quarters of
the way down are done when the jaw is half open. One that is put out rises first, over the lower teeth."""
RISE_M, OVER_M = 0.004, 0.006
"""How much higher than by the unit the tip lies when the tongue is out, and how far it rises on its way: over the lower
teeth and the lip."""
SHARE = 0.5
"""How high the back of the tongue lies when the jaw is fully open: of the way from the edges of the lower front teeth
to those of the upper ones."""
CLEAR_M = 0.0007
"""Between the tongue and what it lies on or beside: lower teeth, their gums and the mouth's floor."""
DEEPEST = 0.85
"""The most of the way to the mouth's floor that a vertex goes down: so the tongue keeps some of its thickness where the
floor is high."""
WIDTHS = np.linspace(1, 0.6, 9)
"""Shares of its width that the tongue may have where the floor's sides are high."""
NEAR_M = 0.003
"""Teeth and gums are beside a vertex that is as near along the arch and in height, and vertices above each other that
are as near along the tongue: less than a tooth is wide."""
BEHIND_M = 0.010
"""Over this way behind the last teeth the tongue becomes as wide as it was."""


def lay_tongue(obj, jaws: Jaws, shape: Mouth) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The tongue's vertices at rest in a head [N, 3], and what each key adds to them [N, 3]."""
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
    """The keys that put the tongue out, of what the unit adds to it [N, 3]; the second one is there half way alone."""
    ahead = np.clip(-moved[:, 1:2], 0, None)
    up = ahead / ahead.max() * [0, 0, 1.0]
    return {OUT: moved + RISE_M * up, OVER: OVER_M * up}


def _within_teeth(asset: FaceUnits, shape: Mouth, points: np.ndarray) -> np.ndarray:
    """Points [N, 3] of the tongue, drawn in where they are in lower teeth or gums; all in the template's axes."""
    arch, teeth = lower_arch(asset), shape.vertices[shape.lower]
    along, inwards, behind, out = arch.beside(points)
    teeth_along, teeth_inwards, _, _ = arch.beside(teeth)
    beside = (np.abs(along[:, None] - teeth_along) < NEAR_M) & (np.abs(points[:, None, 2] - teeth[:, 2]) < NEAR_M)
    least = np.where(beside, teeth_inwards, -np.inf).max(1) + CLEAR_M
    missing = np.clip(least - inwards, 0, None) * np.clip(1 - behind / BEHIND_M, 0, 1)
    return points - missing[:, None] * out


def _laid_down(opened: np.ndarray, edges: tuple[float, float], floor: BVHTree) -> np.ndarray:
    """Places [N, 3] of a tongue when the jaw is fully open.

    opened: where it would be if it went with the jaw as the teeth do; edges: heights of the upper front teeth's edges
    and of the lower ones' then; floor: the mouth's lining then.
    """
    upper, lower = edges
    column = np.abs(opened[:, None, 1] - opened[None, :, 1]) < NEAR_M  # [N, N] which stand above each other
    back = np.where(column, opened[None, :, 2], -np.inf).max(1)
    height = np.clip(back - lower, 0, None)
    by = height * np.clip(1 - SHARE * (upper - lower) / max(height.max(), CLEAR_M), 0, 1)
    places = _narrowed(opened, column, back - by - CLEAR_M, floor)
    by = np.minimum(by, DEEPEST * (places[:, 2] - _heights(floor, places) - CLEAR_M))
    return places - np.clip(by, 0, None)[:, None] * [0, 0, 1.0]


def _narrowed(places: np.ndarray, column: np.ndarray, most: np.ndarray, floor: BVHTree) -> np.ndarray:
    """Places [N, 3] with their sides drawn in to where the floor is no higher than `most` [N]."""
    middle, offset = places.mean(0) * [1, 0, 0], places - places.mean(0) * [1, 0, 0]
    fits = np.array([_heights(floor, middle + offset * [share, 1, 1]) < most for share in WIDTHS])  # [W, N]
    fits = (fits[:, None] | ~column).all(2)
    share = WIDTHS[np.where(fits.any(0), fits.argmax(0), -1)]
    share = (column * share).sum(1) / column.sum(1)
    return middle + offset * np.stack([share, np.ones_like(share), np.ones_like(share)], 1)


def _heights(floor: BVHTree, places: np.ndarray) -> np.ndarray:
    """Of the floor below places [N, 3]; -inf where there is none."""
    hits = [floor.ray_cast(place, (0, 0, -1))[0] for place in places.tolist()]
    return np.array([-np.inf if hit is None else hit.z for hit in hits])


def _lining(asset: FaceUnits, places: np.ndarray) -> BVHTree:
    """The insides of the cheeks and the mouth's floor, of a head's places [V + C + P, 3]."""
    inside = np.zeros(len(places), bool)
    inside[len(asset.template) + len(asset.copies) + lining(asset)] = True
    faces = asset.faces[inside[asset.faces[:, :3]].any(1)].tolist()
    return BVHTree.FromPolygons(places.tolist(), [[corner for corner in face if corner >= 0] for face in faces])
