# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up's objects of the mouth: teeth in gums, and a tongue, carried to the head as its own bands are, with
shape keys that go along with its units."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ..asset import FaceUnits, load
from . import ball, materials, mouth_shapes, nodes

SHOWN_M, FARTHEST_M = 0.001, 0.006
"""How far the upper teeth end below where the lips meet, as most people's do, and how far they are moved for it at
most: the bands of the built-in head are carried by the face around them, which knows nothing of where lips end."""
WIDE_M = 0.009
"""Half the width of the upper front teeth that are looked at for it."""
LEAST_M = 3e-4
"""A unit that moves jaw and tongue by less moves the lips alone."""
OUT, OVER = "tongueOut", "tongueOver"
RISE_M, OVER_M = 0.004, 0.006
"""How much higher than by the unit the tip lies when the tongue is out, and how far it rises on its way: over the lower
teeth and the lip."""
OUT_BY = "min(tongueOut, jawOpen)"
"""Through closed lips no tongue comes: it goes as far as the jaw is open."""


def build(obj, keep) -> None:
    """Makes or renews teeth and tongue; `keep(kind, data, finish)` is as the eyes have it."""
    asset = load()
    upper, lower, tongue = mouth_shapes.bands(asset)
    first = len(asset.template) + len(asset.copies)
    keys = obj.data.shape_keys.key_blocks
    rest = ball.places(keys[0])[first:]
    moves = {name: ball.places(keys[name])[first:] - rest for name in asset.units}
    moves = {name: moved for name, moved in moves.items()
             if np.abs(moved[np.concatenate([lower, tongue])]).max() > LEAST_M}
    shape = mouth_shapes.teeth_and_gums(asset)
    placed = _affine(asset.parts[np.concatenate([upper, lower])], rest[np.concatenate([upper, lower])], shape.vertices)
    lower_by = _lowering(asset, ball.places(keys[0]), placed[~shape.lower])
    placed = placed + lower_by
    turned = {name: np.where(shape.lower[:, None], _affine(rest[lower], moved[lower], placed), 0)
              for name, moved in moves.items()}
    front = float(placed[:, 1].min())

    def finish_teeth(thing):
        materials.fill(thing, materials.teeth(obj.name, front), materials.gums(obj.name, front))
        _keyed(thing, obj, placed, turned)

    def finish_tongue(thing):
        materials.fill(thing, materials.tongue(obj.name, front))
        _keyed(thing, obj, rest[tongue] + lower_by, _tongue_moves(moves, tongue),
               {OUT: OUT_BY, OVER: f"4 * {OUT_BY} * (1 - {OUT_BY})"})
        modifier = thing.modifiers.get("Subdivision") or thing.modifiers.new("Subdivision", 'SUBSURF')
        modifier.levels, modifier.render_levels = 1, 2

    keep("Teeth", _data(f"{obj.name} Teeth and Gums", placed, shape.faces, shape.slots), finish_teeth)
    nodes.modify(obj, nodes.lids_on_eyes(), Lining=materials.gums(obj.name, front))
    faces = [[int(where) for where in np.searchsorted(tongue, [i - first for i in face if i >= 0])]
             for face in _faces(asset, first, tongue)]
    keep("Tongue", _data(f"{obj.name} Tongue", rest[tongue] + lower_by, faces, np.zeros(len(faces))), finish_tongue)


def _tongue_moves(moves: dict[str, np.ndarray], tongue: np.ndarray) -> dict[str, np.ndarray]:
    """What each unit adds to the tongue's vertices; the one that puts it out has a second key, which is there half way
    alone."""
    moves = {name: moved[tongue] for name, moved in moves.items()}
    ahead = np.clip(-moves[OUT][:, 1:2], 0, None)
    up = ahead / ahead.max() * [0, 0, 1.0]
    return moves | {OUT: moves[OUT] + RISE_M * up, OVER: OVER_M * up}


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


def _faces(asset: FaceUnits, first: int, rows: np.ndarray) -> list[list[int]]:
    inside = np.isin(asset.faces[:, 0] - first, rows)
    return asset.faces[inside].tolist()


def _data(name: str, vertices: np.ndarray, faces: list, slots: np.ndarray):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("material_index", slots.astype(np.int32))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _keyed(
    mouth_object, obj, rest_points: np.ndarray, moves: dict[str, np.ndarray], led_by: dict[str, str] | None = None
) -> None:
    """Shape keys of the units that move it, driven by the head's own. led_by: expressions of units for keys that more
    than one unit leads."""
    mouth_object.shape_key_add(name="Basis", from_mix=False)
    for name, moved in moves.items():
        if np.abs(moved).max() < LEAST_M:
            continue
        key = mouth_object.shape_key_add(name=name, from_mix=False)
        key.slider_min, key.slider_max = -10, 10  # the head's own sliders are the limit
        key.data.foreach_set("co", (rest_points + moved).astype(np.float32).ravel())
        driver = key.driver_add("value").driver
        driver.type = 'SCRIPTED'
        driver.expression = (led_by or {}).get(name, name)
        for unit in sorted(set(re.findall(r"[a-z]+[A-Z]\w*", driver.expression))):
            variable = driver.variables.new()
            variable.name = unit
            variable.targets[0].id_type, variable.targets[0].id = 'KEY', obj.data.shape_keys
            variable.targets[0].data_path = f'key_blocks["{unit}"].value'
