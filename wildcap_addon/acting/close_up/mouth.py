# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up's objects of the mouth: teeth in gums, and a tongue, carried to the head as its own bands are, with
shape keys that go along with its units."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ..asset import FaceUnits, load
from . import materials, mouth_shapes, nodes, tongue
from .jaws import LEAST_M, find_jaws


def build(obj, keep) -> None:
    """Makes or renews teeth and tongue; `keep(kind, data, finish)` is as the eyes have it."""
    asset = load()
    shape = mouth_shapes.teeth_and_gums(asset)
    jaws = find_jaws(obj, shape)
    placed = jaws.placed(shape.vertices)
    turned = {name: np.where(shape.lower[:, None], jaws.turned(name, placed), 0) for name in jaws.moves}
    tongue_at_rest, tongue_moves = tongue.lay_tongue(obj, jaws, shape)
    front = float(placed[:, 1].min())

    def finish_teeth(thing):
        materials.fill(thing, materials.teeth(obj.name, front), materials.gums(obj.name, front))
        _keyed(thing, obj, placed, turned)

    def finish_tongue(thing):
        materials.fill(thing, materials.tongue(obj.name, front))
        _keyed(thing, obj, tongue_at_rest, tongue_moves, tongue.LED_BY)
        modifier = thing.modifiers.get("Subdivision") or thing.modifiers.new("Subdivision", 'SUBSURF')
        modifier.levels, modifier.render_levels = 1, 2

    keep("Teeth", _data(f"{obj.name} Teeth and Gums", placed, shape.faces, shape.slots), finish_teeth)
    nodes.modify(obj, nodes.lids_on_eyes(), Lining=materials.gums(obj.name, front))
    faces = _faces(asset, jaws.tongue)
    keep("Tongue", _data(f"{obj.name} Tongue", tongue_at_rest, faces, np.zeros(len(faces))), finish_tongue)


def _faces(asset: FaceUnits, rows: np.ndarray) -> list[list[int]]:
    """Those of some inner vertices, counted by themselves."""
    first = len(asset.template) + len(asset.copies)
    inside = np.isin(asset.faces[:, 0] - first, rows)
    return [
        [int(where) for where in np.searchsorted(rows, [i - first for i in face if i >= 0])]
        for face in asset.faces[inside].tolist()
    ]


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
