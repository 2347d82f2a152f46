# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat sheet: a square with the whole texture, seen from above, to paint the mask in UV space.

It stores what it hides in a property of its own, which an undo restores together with it.
"""

import json

import bpy

from .. import captures, node_trees

SIDE_M = 0.4  # of the plane
NAME = "WildCap Mask Sheet"
HIDDEN_KEY = "wildcap_hidden"


def is_there() -> bool:
    """Return whether there is a sheet: an undo may change it."""
    return NAME in bpy.data.objects


def make(context, image: bpy.types.Image, head: bpy.types.Object) -> bpy.types.Object:
    """Make the sheet, SIDE_M wide, UV (0, 0) at its lower left, with the head's symmetry, and hide everything else."""
    remove()
    mesh = bpy.data.meshes.new(NAME)
    half = SIDE_M / 2
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    mesh.use_mirror_x = head.data.use_mirror_x
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", (0, 0, 1, 0, 1, 1, 0, 1))
    material = bpy.data.materials.new(NAME)
    nodes = node_trees.of(material).nodes
    node = nodes.new('ShaderNodeTexImage')
    node.image = image
    nodes.active = node
    mesh.materials.append(material)
    sheet = bpy.data.objects.new(NAME, mesh)
    sheet[captures.HEAD_KEY] = head[captures.HEAD_KEY]  # the panel shows this capture
    context.scene.collection.objects.link(sheet)
    context.view_layer.update()  # or a removed object stays in it, and Blender crashes
    others = [thing for thing in context.view_layer.objects if thing != sheet and not thing.hide_get()]
    sheet[HIDDEN_KEY] = json.dumps([thing.name for thing in others])
    for thing in others:
        thing.hide_set(True)
    return sheet


def remove(head: bpy.types.Object | None = None) -> None:
    """Remove the sheet and its data, and show what it hid; the head gets the symmetry that was set on it."""
    if head is not None and NAME in bpy.data.meshes:
        head.data.use_mirror_x = bpy.data.meshes[NAME].use_mirror_x
    hidden = json.loads(bpy.data.objects[NAME].get(HIDDEN_KEY, "[]")) if is_there() else []
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.materials):
        block = collection.get(NAME)
        if block is not None:
            collection.remove(block)
    bpy.context.view_layer.update()
    for name in hidden:
        if name in bpy.context.view_layer.objects:
            bpy.context.view_layer.objects[name].hide_set(False)
