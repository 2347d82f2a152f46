# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head's mesh cut open, with eyes and mouth in it, and its shape keys: made once, later only moved, so that keys and animation stay.

For exporters: the keys are called as ARKit calls them (`jawOpen`, `eyeBlinkLeft`), their basis is the head as solved, lids closed;
`eyesOpenLeft` and `eyesOpenRight` open the lids and are no names of ARKit's. Slots: skin, "... Eyes", "... Mouth", "... Teeth".
The custom property `MARK` of the mesh says that it has them.
"""

import bpy
import numpy as np

from ...core.contract.messages import Problem
from . import carrying, materials
from .asset import GAZE, SIDES, FaceUnits, load

MARK = "wildcap_face_units"
OPEN = "eyesOpen"
"""Custom property of the shape keys: how far the lids are open, 0 to 1."""
LAYOUT = {'FLOAT': ("value", 1), 'FLOAT_VECTOR': ("vector", 3), 'FLOAT_COLOR': ("color", 4)}
"""Kinds of attributes that are carried over: field, and how many numbers it has."""


def has(obj) -> bool:
    return MARK in obj.data and obj.data.shape_keys is not None


def add(obj, iris: str) -> None:
    """Cuts the head open and gives it its face units. Raises Problem if it is not the built-in head, unchanged."""
    asset = load()
    old = obj.data
    _check(obj, asset)
    head, normals = _vertices(old), _corner_normals(old)
    carried = carrying.carried(asset, head)
    new = _built(old, asset, carried[0])
    slots = list(old.materials) or [None]
    for material in slots[:1] + materials.inside(obj.name, iris):
        new.materials.append(material)
    obj.data = new
    name = old.name
    if old.users == 0:
        bpy.data.meshes.remove(old)
    new.name = name
    new[MARK] = 1
    obj.shape_key_add(name="Basis", from_mix=False)
    for unit in asset.units:
        obj.shape_key_add(name=unit, from_mix=False).value = 0  # Blender 5 begins with 1
    _shape(obj, *carried, normals)
    _drive(new.shape_keys)


def follow(obj, head: np.ndarray, normals: np.ndarray) -> None:
    """Moves a head that has its units to another registered shape [V, 3]; values, animation, drivers and the artist's own keys stay."""
    _shape(obj, *carrying.carried(load(), head), normals)


def _shape(obj, rest: np.ndarray, units: dict, normals: np.ndarray) -> None:
    keys = obj.data.shape_keys
    before = np.empty(rest.size, np.float32)
    keys.reference_key.data.foreach_get("co", before)
    for key in keys.key_blocks:
        if key == keys.reference_key:
            continue
        if key.name in units:
            rows, moves = units[key.name]
            shape = rest.copy()
            shape[rows] += moves
        else:  # one that the artist made: its displacements stay as they are
            shape = np.empty(rest.size, np.float32)
            key.data.foreach_get("co", shape)
            shape = (shape - before).reshape(-1, 3) + rest
        key.data.foreach_set("co", shape.astype(np.float32).ravel())
    keys.reference_key.data.foreach_set("co", rest.astype(np.float32).ravel())
    obj.data.vertices.foreach_set("co", rest.astype(np.float32).ravel())
    _set_normals(obj.data, normals)
    obj.data.update()


def rest(obj) -> None:
    """All values zero, lids closed: the head as solved."""
    keys = obj.data.shape_keys
    for key in keys.key_blocks:
        key.value = 0
    keys[OPEN] = 0.0
    keys.update_tag()


def renewed(obj, mesh) -> bool:
    """Whether the head has units and now follows the new mesh, which is then not needed; `head.bring_in` asks."""
    if not has(obj) or len(mesh.vertices) != len(load().template):
        return False
    follow(obj, _vertices(mesh), _corner_normals(mesh))
    return True


def _check(obj, asset: FaceUnits) -> None:
    mesh = obj.data
    if mesh.shape_keys is not None:
        raise Problem("This head has shape keys of its own.", "Remove them, or bring the head in anew, then click Add Face Units.")
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    if len(mesh.vertices) != len(asset.template) or not np.array_equal(corners, asset.triangles.ravel()):
        raise Problem("Face units are made for the built-in head, and this is another mesh.", "Reconstruct with the built-in head, or bring the head in anew.")


def _built(old, asset: FaceUnits, rest: np.ndarray):
    """The mesh at rest, its UVs those of the head; inner parts but the skin's have theirs in tiles to the right, where no map of the skin lies."""
    triangles = asset.triangles.copy()
    triangles[asset.corners[:, 0], asset.corners[:, 1]] = asset.corners[:, 2]
    inner = [[i for i in face if i >= 0] for face in asset.faces.tolist()]
    mesh = bpy.data.meshes.new(old.name)
    mesh.from_pydata(rest, [], triangles.tolist() + inner)
    uv = np.empty(2 * len(old.loops), np.float32)
    old.uv_layers[0].data.foreach_get("uv", uv)
    first = len(rest) - len(asset.parts)
    known = np.zeros((len(rest), 2))  # of each vertex of the seams, by its side
    np.put_along_axis(known, triangles.ravel()[:, None].repeat(2, 1), uv.reshape(-1, 2), 0)
    known[first:] = asset.uvs
    corners = np.concatenate([np.array(face) for face in inner])
    tile = np.repeat(asset.slots, [len(face) for face in inner])
    extra = known[corners] + np.stack([tile, 0 * tile], 1)
    layer = mesh.uv_layers.new(name=old.uv_layers[0].name)
    layer.data.foreach_set("uv", np.concatenate([uv, extra.astype(np.float32).ravel()]))
    mesh.polygons.foreach_set("material_index", np.concatenate([np.zeros(len(triangles), np.int32), asset.slots.astype(np.int32)]))
    mesh.shade_smooth()
    _attributes(old, mesh, asset)
    mesh.update()
    return mesh


def _attributes(old, new, asset: FaceUnits) -> None:
    """What is kept for each vertex of the head (its roughness, an artist's mask), on the copies as on what they double; zero inside."""
    for attribute in old.attributes:
        if attribute.domain == 'POINT' and attribute.data_type in LAYOUT and not attribute.is_internal and not attribute.is_required:
            field, width = LAYOUT[attribute.data_type]
            values = np.empty((len(old.vertices), width), np.float32)
            attribute.data.foreach_get(field, values.ravel())
            every = np.concatenate([values, values[asset.copies], np.zeros((len(asset.parts), width), np.float32)])
            new.attributes.new(attribute.name, attribute.data_type, 'POINT').data.foreach_set(field, every.ravel())


def _vertices(mesh) -> np.ndarray:
    co = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", co)
    return co.reshape(-1, 3).astype(np.float64)


def _corner_normals(mesh) -> np.ndarray:
    """Normals [L, 3] at the corners of the head before it was cut: along the seams they are those of a closed face."""
    normals = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    return normals.reshape(-1, 3)


def _set_normals(mesh, normals: np.ndarray) -> None:
    """The closed head's normals on its faces; zero lets Blender find the others."""
    every = np.zeros((len(mesh.loops), 3), np.float32)
    every[:len(normals)] = normals
    mesh.normals_split_custom_set(every)


def _drive(keys) -> None:
    """Lids open by the slider, or as far as a unit of the eye is used: drivers of kind Maximum, which need no script."""
    keys[OPEN] = 0.0
    keys.id_properties_ui(OPEN).update(min=0.0, max=1.0, soft_min=0.0, soft_max=1.0, description="How far the lids are open; they were solved closed")
    for side in SIDES:
        driver = keys.key_blocks[f"{OPEN}{side}"].driver_add("value").driver
        driver.type = 'MAX'
        for path in (f'["{OPEN}"]', *(f'key_blocks["{unit}{side}"].value' for unit in GAZE)):
            variable = driver.variables.new()
            variable.targets[0].id_type = 'KEY'
            variable.targets[0].id = keys
            variable.targets[0].data_path = path
