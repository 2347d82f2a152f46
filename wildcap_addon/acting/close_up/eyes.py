# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up's objects of both eyes, children of the head: what turns is turned by the head's look units, what lies
on the lids finds them by geometry nodes.

No object hangs on the head's vertices: the head's lids keep to these eyes, so that the eyes cannot wait for the head's
shape."""

from __future__ import annotations

import bpy
import numpy as np

from ...data_blocks import read_field
from .. import materials as of_the_head
from ..asset import LEFT_EYE, SIDES, FaceUnits, lining, load, sockets
from . import ball, keeping, materials, nodes, shapes

REACH_M = 0.00042
"""How far tears climb onto the ball and up the margin of a lid."""
VERTICES_ACROSS = 5
"""Vertices of the margin and of the wet line from the lid to the ball."""
CARUNCLE_M = 0.0054
"""From the inner corner outwards, over which the caruncle comes down to the ball: life's is some 5 mm wide, and its
fold follows."""
BOWED = 0.5
"""How much sooner it comes down in its middle than at the lids: its edge is a crescent."""
LIFT_SHARE = 0.10
"""How far the caruncle stands out in its middle, as a share of the lids' opening there."""


def build(obj, keep, iris_m: tuple[float, float]) -> None:
    """Makes or renews the objects of both eyes; `keep(kind, data, finish)` gives the object of a kind, which has the
    new mesh data and went through `finish`, or is as the artist left it. iris_m: radii in metres."""
    asset = load()
    shells = []
    for number, side in enumerate(SIDES):
        eye = ball.of(obj, number)
        edge = shapes.limbus(eye.radius, iris_m[number])

        def finish_inner(thing, eye=eye, side=side):
            _place(thing, obj, eye, side)
            materials.fill(
                thing,
                materials.white(obj.name),
                materials.iris(obj.name, of_the_head.colour_of(obj)),
                materials.pupil(obj.name),
            )

        def finish_shell(thing, eye=eye, side=side):
            _place(thing, obj, eye, side)
            materials.fill(thing, materials.cornea(obj.name))
            _let_light_in(thing)

        keep(f"{side} Eye", _turned(f"{obj.name} {side} Eye", shapes.inner(eye.radius, edge), number), finish_inner)
        shell = keep(
            f"{side} Cornea", _turned(f"{obj.name} {side} Cornea", shapes.shell(eye.radius, edge), 0), finish_shell
        )

        def finish_margin(thing, shell=shell):
            materials.fill(thing, obj.data.materials[0])  # the head's skin, in the colour of the rim
            nodes.modify(thing, nodes.lid_margin(), Head=obj, Shell=shell)

        def finish_wet(thing, shell=shell):
            materials.fill(thing, materials.tears(obj.name))
            _let_light_in(thing)
            nodes.modify(thing, nodes.wet_line(), Head=obj, Shell=shell)
            _smoothed(thing)

        def finish_flesh(thing, shell=shell):
            materials.fill(thing, materials.flesh(obj.name))
            nodes.modify(thing, nodes.caruncle(), Head=obj, Shell=shell)
            _smoothed(thing)

        rims = ball.rims(asset, number)
        keep(f"{side} Lid Margin", _margin(f"{obj.name} {side} Lid Margin", rims, obj.data), finish_margin)
        keep(f"{side} Wet Line", _along_lids(f"{obj.name} {side} Wet Line", rims, {"reach": REACH_M}), finish_wet)
        keep(f"{side} Caruncle", _caruncle(f"{obj.name} {side} Caruncle", rims, asset), finish_flesh)
        shells.append(shell)
    inner = len(asset.template) + len(asset.copies)
    _mark(obj.data, inner + np.setdiff1d(sockets(asset), lining(asset)))
    nodes.modify(
        obj,
        nodes.lids_on_eyes(),
        Left=shells[0],
        Right=shells[1],
        First=inner + int(np.flatnonzero(asset.kind == LEFT_EYE)[0]),
    )


def _mark(mesh, rows: np.ndarray) -> None:
    """Notes of the head's vertices which ones [n] line the sockets: the lids' geometry nodes take them away."""
    lining = np.zeros(len(mesh.vertices), bool)
    lining[rows] = True
    layer = mesh.attributes.get(nodes.SOCKET) or mesh.attributes.new(nodes.SOCKET, 'BOOLEAN', 'POINT')
    layer.data.foreach_set("value", lining)


def _turned(name: str, shape: shapes.Turned, number: int):
    """Mesh data of a shape; the right eye's picture is turned over, so that what lies towards the nose does on both."""
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


def _along_lids(name: str, rims: ball.LidRims, constant: dict[str, float]):
    """Two strips, along the upper and the lower lid; where its vertices lie, geometry nodes find."""
    rim = np.concatenate([rims.upper, rims.lower])
    opposite = np.concatenate([rims.lower, rims.upper])
    across = np.tile(np.linspace(0, 1, VERTICES_ACROSS), len(rim))
    strips = [
        _grid(len(rims.upper), VERTICES_ACROSS, flipped=True),
        len(rims.upper) * VERTICES_ACROSS + _grid(len(rims.lower), VERTICES_ACROSS),
    ]
    return _strip(
        name,
        np.concatenate(strips),
        {
            "rim": rim.repeat(VERTICES_ACROSS),
            "opposite": opposite.repeat(VERTICES_ACROSS),
            "across": across,
            **{key: np.full(len(across), value) for key, value in constant.items()},
        },
    )


def _margin(name: str, rims: ball.LidRims, head):
    """The same with the UVs of the rims, all the way down."""
    mesh = _along_lids(name, rims, {})
    known = np.zeros((len(head.vertices), 2), np.float32)
    known[read_field(head.loops, "vertex_index", kind=np.int32)] = read_field(head.uv_layers[0].data, "uv", 2)
    of_rim = known[np.concatenate([rims.upper, rims.lower])].repeat(VERTICES_ACROSS, 0)
    own = read_field(mesh.loops, "vertex_index", kind=np.int32)
    mesh.uv_layers.new(name=head.uv_layers[0].name).data.foreach_set("uv", of_rim[own].ravel())
    return mesh


def _caruncle(name: str, rims: ball.LidRims, asset: FaceUnits):
    """A sheet from the inner corner outwards, as wide as the lids are open."""
    away = np.linalg.norm(asset.template[rims.upper] - asset.template[rims.corner], axis=1)
    count = int((away < CARUNCLE_M).sum())
    upper, lower = np.append(rims.corner, rims.upper[:count]), np.append(rims.corner, rims.lower[:count])
    along = np.append(0, away[:count]) / CARUNCLE_M
    rows = 7
    across = np.tile(np.linspace(0, 1, rows), count + 1)
    early = 1 + BOWED * np.sin(np.pi * across)
    t = np.clip((along.repeat(rows) * early - 0.3) / 0.7, 0, 1)
    onto = t * t * (3 - 2 * t)
    hump = np.sin(np.pi * across) * (1 - 0.5 * onto)
    return _strip(
        name,
        _grid(count + 1, rows, flipped=True),
        {
            "rim": upper.repeat(rows),
            "opposite": lower.repeat(rows),
            "across": across,
            "onto": onto,
            "lift": LIFT_SHARE * hump,
        },
    )


def _grid(count: int, rows: int, flipped: bool = False) -> np.ndarray:
    """Quads [F, 4] of count columns of `rows` vertices, one column after the other."""
    a = (np.arange(count - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    quads = np.stack([a, a + rows, a + rows + 1, a + 1], 1)
    return quads[:, ::-1] if flipped else quads


def _strip(name: str, faces: np.ndarray, attributes: dict[str, np.ndarray]):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.zeros((len(next(iter(attributes.values()))), 3)), [], faces)
    for key, values in attributes.items():
        whole = values.dtype.kind == "i"
        layer = mesh.attributes.new(key, 'INT' if whole else 'FLOAT', 'POINT')
        layer.data.foreach_set("value", values.astype(np.int32 if whole else np.float32))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _place(eye_object, obj, eye: ball.RiggedEyeball, side: str) -> None:
    """At the ball's middle, turned by the head's look units: sums of products, which need no script."""
    eye_object.location, eye_object.rotation_mode = eye.centre, 'XYZ'
    for axis, rest, share in ((0, -eye.pitch, 0), (2, eye.yaw, 1)):
        eye_object.driver_remove("rotation_euler", axis)
        driver = eye_object.driver_add("rotation_euler", axis).driver
        driver.type = 'SCRIPTED'
        terms = [f"{rest:.6f}"]
        for way, turn in eye.turns.items():
            variable = driver.variables.new()
            variable.name = f"look_{way.lower()}"
            variable.targets[0].id_type, variable.targets[0].id = 'KEY', obj.data.shape_keys
            variable.targets[0].data_path = f'key_blocks["eyeLook{way}{side}"].value'
            terms.append(f"{turn[share] * (1 if share else -1):.6f} * look_{way.lower()}")
        driver.expression = " + ".join(terms)


def _let_light_in(obj) -> None:
    """What is clear throws no shadow on what is behind; light that was scattered there goes out through it. Set once:
    afterwards it is the artist's."""
    if keeping.MADE not in obj:
        obj.visible_shadow = obj.visible_diffuse = False


def _smoothed(obj) -> None:
    modifier = obj.modifiers.get("Subdivision") or obj.modifiers.new("Subdivision", 'SUBSURF')
    modifier.levels, modifier.render_levels = 1, 2
