# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The flat sheet: one square with the whole texture on it, looked at from straight above, to paint the mask in UV
space.

What it hides it keeps in a property of its own, which an undo brings back together with it.
"""

import json

import bpy

from .. import captures, node_trees

SIDE_M = 0.4  # of the plane
NAME = "WildCap Mask Sheet"
HIDDEN_KEY = "wildcap_hidden"


def is_there() -> bool:
    """Whether there is a sheet: by an undo it may come and go."""
    return NAME in bpy.data.objects


def make(context, image: bpy.types.Image, head: bpy.types.Object) -> bpy.types.Object:
    """The sheet in the scene: SIDE_M wide, UV (0, 0) at its lower left, the texture in a material, painted with the
    head's symmetry. Everything else is hidden."""
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
    sheet[captures.HEAD_KEY] = head[captures.HEAD_KEY]  # the panel means this capture, whichever is chosen in the list
    context.scene.collection.objects.link(sheet)
    context.view_layer.update()  # or whoever looks through its objects next finds one that is gone, and Blender ends
    others = [thing for thing in context.view_layer.objects if thing != sheet and not thing.hide_get()]
    sheet[HIDDEN_KEY] = json.dumps([thing.name for thing in others])
    for thing in others:
        thing.hide_set(True)
    return sheet


def remove(head: bpy.types.Object | None = None) -> None:
    """Takes the sheet and all it is made of away, and shows what it hid; the symmetry that was set on it goes over to
    the head."""
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
