# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the close-up's mouth: teeth in gums, and a tongue, with shape keys that the head's units drive."""

from __future__ import annotations

import re

import bpy
import numpy as np

from ...data_blocks import add_driver, add_variable, value_path
from ..asset import load
from . import materials, mouth_shapes, nodes, tongue
from .jaws import LEAST_M, find_jaws


def build(obj, keep) -> None:
    """Make or renew teeth and tongue; `keep` as in eyes.build."""
    asset = load()
    shape = mouth_shapes.teeth_and_gums(asset)
    jaws = find_jaws(obj, shape)
    placed = jaws.placed(shape.vertices)
    turned = {name: np.where(shape.lower[:, None], jaws.turned(name, placed), 0) for name in jaws.moves}
    tongue_at_rest, tongue_moves = tongue.lay_tongue(obj, jaws, shape)
    front = float(placed[:, 1].min())
    gums = materials.gums(obj.name, front)

    def finish_teeth(thing):
        materials.fill(thing, materials.teeth(obj.name, front), gums)
        _add_keys(thing, obj, placed, turned, {})

    def finish_tongue(thing):
        materials.fill(thing, materials.tongue(obj.name, front))
        _add_keys(thing, obj, tongue_at_rest, tongue_moves, tongue.LED_BY)
        nodes.subdivide(thing)

    keep("Teeth", _mesh(f"{obj.name} Teeth and Gums", placed, shape.faces, shape.slots), finish_teeth)
    nodes.modify(obj, nodes.lids_on_eyes(), Lining=gums)
    rows = asset.first_inner + jaws.tongue
    inside = np.isin(asset.faces[:, 0], rows)
    faces = [np.searchsorted(rows, [i for i in face if i >= 0]).tolist() for face in asset.faces[inside].tolist()]
    keep("Tongue", _mesh(f"{obj.name} Tongue", tongue_at_rest, faces, np.zeros(len(faces))), finish_tongue)


def _mesh(name: str, vertices: np.ndarray, faces: list, slots: np.ndarray):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("material_index", slots.astype(np.int32))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _add_keys(thing, obj, rest_points: np.ndarray, moves: dict[str, np.ndarray], led_by: dict[str, str]) -> None:
    """Add shape keys, driven by the head's unit of the same name or by an expression of units."""
    thing.shape_key_add(name="Basis", from_mix=False)
    for name, moved in moves.items():
        if np.abs(moved).max() < LEAST_M:
            continue
        key = thing.shape_key_add(name=name, from_mix=False)
        key.slider_min, key.slider_max = -10, 10  # the head's own sliders are the limit
        key.data.foreach_set("co", (rest_points + moved).astype(np.float32).ravel())
        driver = add_driver(key, "value", led_by.get(name, name))
        for unit in sorted(set(re.findall(r"[a-z]+[A-Z]\w*", driver.expression))):
            add_variable(driver, obj.data.shape_keys, value_path(unit), unit)
