# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the close-up's objects of both eyes, children of the head.

The head's look units turn the eyes, and geometry nodes put what lies on the lids in its place. No object is parented to
the head's vertices: the head's lids follow these eyes, which cannot wait for the head's shape.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...data_blocks import add_driver, add_variable, read_field, value_path
from .. import materials as head_materials
from ..asset import LEFT_EYE, SIDES, FaceUnits, lining, load, sockets
from . import ball, keeping, materials, nodes, shapes

REACH_M = 0.00042
"""Reach of tears onto the ball and up the margin of a lid."""
ACROSS, CARUNCLE_ACROSS = 5, 7
"""Vertices from the lid to the ball, of margin and wet line, and from lid to lid, of the caruncle."""
CARUNCLE_M = 0.0054
"""Length over which the caruncle comes down to the ball: life's is about 5 mm wide, and its fold follows."""
BOWED = 0.5
"""Lead of its middle over the lids in coming down: its edge is a crescent."""
LIFT_SHARE = 0.10
"""Height of the caruncle's middle, as a share of the lids' opening there."""


def build(obj, keep, iris_m: tuple[float, float]) -> None:
    """Make or renew the objects of both eyes.

    keep(kind, data, finish): returns the object of a kind, which has the new mesh data and went through `finish`, or is
    as the artist left it. iris_m: radii.
    """
    asset = load()
    shells = [_build_side(obj, keep, asset, number, iris_m[number]) for number in range(2)]
    _mark_sockets(obj.data, asset.first_inner + np.setdiff1d(sockets(asset), lining(asset)))
    first = asset.first_inner + int(np.flatnonzero(asset.kind == LEFT_EYE)[0])
    nodes.modify(obj, nodes.lids_on_eyes(), Left=shells[0], Right=shells[1], First=first)


def _build_side(obj, keep, asset: FaceUnits, number: int, iris_m: float) -> bpy.types.Object:
    """Make or renew the objects of the left (0) or right eye; return the clear shell."""
    name, side, eye = obj.name, SIDES[number], ball.of(obj, number)
    edge = shapes.limbus(eye.radius, iris_m)

    def finish_inner(thing):
        _place(thing, obj, eye, side)
        iris = materials.iris(name, head_materials.colour_of(obj))
        materials.fill(thing, materials.white(name), iris, materials.pupil(name))

    def finish_shell(thing):
        _place(thing, obj, eye, side)
        materials.fill(thing, materials.cornea(name))
        _let_light_in(thing)

    keep(f"{side} Eye", _turned(f"{name} {side} Eye", shapes.inner(eye.radius, edge), number), finish_inner)
    shell = keep(f"{side} Cornea", _turned(f"{name} {side} Cornea", shapes.shell(eye.radius, edge), 0), finish_shell)

    def finish_margin(thing):
        materials.fill(thing, obj.data.materials[0])  # the head's skin, in the colour of the rim
        nodes.modify(thing, nodes.lid_margin(), Head=obj, Shell=shell)

    def finish_wet(thing):
        materials.fill(thing, materials.tears(name))
        _let_light_in(thing)
        nodes.modify(thing, nodes.wet_line(), Head=obj, Shell=shell)
        nodes.subdivide(thing)

    def finish_flesh(thing):
        materials.fill(thing, materials.flesh(name))
        nodes.modify(thing, nodes.caruncle(), Head=obj, Shell=shell)
        nodes.subdivide(thing)

    rims = ball.rims(asset, number)
    keep(f"{side} Lid Margin", _margin(f"{name} {side} Lid Margin", rims, obj.data), finish_margin)
    keep(f"{side} Wet Line", _along_lids(f"{name} {side} Wet Line", rims, REACH_M), finish_wet)
    keep(f"{side} Caruncle", _caruncle(f"{name} {side} Caruncle", rims, asset), finish_flesh)
    return shell


def _mark_sockets(mesh, rows: np.ndarray) -> None:
    """Mark the head's vertices [n] that line the sockets: the lids' geometry nodes remove them."""
    marked = np.zeros(len(mesh.vertices), bool)
    marked[rows] = True
    layer = mesh.attributes.get(nodes.SOCKET) or mesh.attributes.new(nodes.SOCKET, 'BOOLEAN', 'POINT')
    layer.data.foreach_set("value", marked)


def _turned(name: str, shape: shapes.Turned, number: int):
    """Return mesh data of a shape; the right eye's picture is mirrored, so that both have the nose on the same side."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.vertices, [], shape.faces)
    uv = shape.uvs.copy()
    if number:
        uv[..., 0] = 0.5 - uv[..., 0]
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", uv.astype(np.float32).ravel())
    mesh.polygons.foreach_set("material_index", shape.slots.astype(np.int32))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _along_lids(name: str, rims: ball.LidRims, reach_m: float | None = None):
    """Return two strips, along the upper and the lower lid, which geometry nodes shape."""
    upper = _grid(len(rims.upper), ACROSS)[:, ::-1]
    faces = np.concatenate([upper, len(rims.upper) * ACROSS + _grid(len(rims.lower), ACROSS)])
    rim, opposite = np.concatenate([rims.upper, rims.lower]), np.concatenate([rims.lower, rims.upper])
    more = {} if reach_m is None else {"reach": np.full(len(rim) * ACROSS, reach_m)}
    return _strip(name, faces, rim, opposite, ACROSS, **more)


def _margin(name: str, rims: ball.LidRims, head):
    """Return such strips with the UVs of the rims all the way down."""
    mesh = _along_lids(name, rims)
    uvs = np.zeros((len(head.vertices), 2), np.float32)
    uvs[read_field(head.loops, "vertex_index", kind=np.int32)] = read_field(head.uv_layers[0].data, "uv", 2)
    of_rim = uvs[np.concatenate([rims.upper, rims.lower])].repeat(ACROSS, 0)
    corners = read_field(mesh.loops, "vertex_index", kind=np.int32)
    mesh.uv_layers.new(name=head.uv_layers[0].name).data.foreach_set("uv", of_rim[corners].ravel())
    return mesh


def _caruncle(name: str, rims: ball.LidRims, asset: FaceUnits):
    """Return a sheet from the inner corner outwards, as wide as the lids are open."""
    away = np.linalg.norm(asset.template[rims.upper] - asset.template[rims.corner], axis=1)
    count, rows = int((away < CARUNCLE_M).sum()), CARUNCLE_ACROSS
    upper, lower = np.append(rims.corner, rims.upper[:count]), np.append(rims.corner, rims.lower[:count])
    along = np.append(0, away[:count]) / CARUNCLE_M
    bow = np.sin(np.pi * np.tile(np.linspace(0, 1, rows), count + 1))
    t = np.clip((along.repeat(rows) * (1 + BOWED * bow) - 0.3) / 0.7, 0, 1)
    onto = t * t * (3 - 2 * t)
    lift = LIFT_SHARE * (bow * (1 - 0.5 * onto))
    return _strip(name, _grid(count + 1, rows)[:, ::-1], upper, lower, rows, onto=onto, lift=lift)


def _grid(count: int, rows: int) -> np.ndarray:
    """Return quads [F, 4] of count columns of `rows` vertices, one column after the other."""
    a = (np.arange(count - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    return np.stack([a, a + rows, a + rows + 1, a + 1], 1)


def _strip(name: str, faces: np.ndarray, rim: np.ndarray, opposite: np.ndarray, across: int, **more: np.ndarray):
    """Return mesh data with `across` vertices for each vertex of a rim, and what the geometry nodes need of them."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.zeros((len(rim) * across, 3)), [], faces)
    shares = np.tile(np.linspace(0, 1, across), len(rim))
    vertices = {"rim": rim.repeat(across), "opposite": opposite.repeat(across), "across": shares, **more}
    for key, values in vertices.items():
        whole = values.dtype.kind == "i"
        layer = mesh.attributes.new(key, 'INT' if whole else 'FLOAT', 'POINT')
        layer.data.foreach_set("value", values.astype(np.int32 if whole else np.float32))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _place(eye_object, obj, eye: ball.RiggedEyeball, side: str) -> None:
    """Put an object at the ball's centre, turned by the head's look units."""
    eye_object.location, eye_object.rotation_mode = eye.centre, 'XYZ'
    for axis, rest, share, sign in ((0, -eye.pitch, 0, -1), (2, eye.yaw, 1, 1)):
        eye_object.driver_remove("rotation_euler", axis)
        terms = [f"{turn[share] * sign:.6f} * look_{way.lower()}" for way, turn in eye.turns.items()]
        driver = add_driver(eye_object, "rotation_euler", " + ".join([f"{rest:.6f}", *terms]), axis)
        for way in eye.turns:
            add_variable(driver, obj.data.shape_keys, value_path(f"eyeLook{way}{side}"), f"look_{way.lower()}")


def _let_light_in(obj) -> None:
    """Let no shadow fall through a clear object, and scattered light pass; set once, afterwards it is the artist's."""
    if keeping.MADE not in obj:
        obj.visible_shadow = obj.visible_diffuse = False
