# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up of a head as a whole: added, renewed when the head has another shape, and taken away again."""

from __future__ import annotations

import bpy

from ... import captures, data_blocks, local_view
from .. import materials as of_the_head
from .. import mesh
from ..asset import load
from . import eyes, mouth, nodes, pictures, shapes

KEY = captures.CLOSE_UP_KEY


def of(obj) -> list[bpy.types.Object]:
    """The objects of a head's close-up."""
    return captures.close_up(obj)


def add(context, obj) -> None:
    """Makes the close-up, or renews it: objects that are there keep their materials, and what was set in them."""
    made: list = []

    def keep(kind: str, data):
        thing = next((child for child in of(obj) if child[KEY] == kind), None)
        if thing is None:
            thing = bpy.data.objects.new(f"{obj.name} {kind}", data)
            for collection in obj.users_collection:
                collection.objects.link(thing)
            thing.parent, thing[KEY] = obj, kind
            made.append(thing)
        else:
            data_blocks.replace_data(thing, data, bpy.data.meshes)
        return thing

    eyes.build(obj, keep, _irises(obj))
    mouth.build(obj, keep)
    local_view.join(context, made)


def remove(obj) -> None:
    """Takes away what `add` made, and what of its materials, pictures and nodes nobody else uses."""
    modifier = obj.modifiers.get(nodes.LIDS)
    if modifier is not None:
        nodes.modify(obj, modifier.node_group, Lining=None)  # Blender 5.2 would go on counting it as a user
        obj.modifiers.remove(modifier)
    things = of(obj)
    made = {slot.material for thing in things for slot in thing.material_slots if slot.material is not None
            and of_the_head.KEY in slot.material}
    data = [thing.data for thing in things]
    for thing in things:
        bpy.data.objects.remove(thing)
    _drop(bpy.data.meshes, data)
    _drop(bpy.data.materials, made)
    _drop(bpy.data.images,
          [image for image in map(bpy.data.images.get, (pictures.IRIS, pictures.WHITE)) if image is not None])
    _drop(bpy.data.node_groups,
          [tree for tree in map(bpy.data.node_groups.get, (nodes.LIDS, nodes.MARGIN, nodes.WET, nodes.CARUNCLE))
           if tree is not None])


def keep_up(obj, _capture) -> None:
    """The close-up of a head that was reconstructed anew is made for its new shape; one of a head that has its units no
    more goes. `head.complete` asks."""
    if of(obj) and mesh.has(obj):
        add(bpy.context, obj)
    elif of(obj):
        remove(obj)


def _drop(collection, blocks) -> None:
    for block in blocks:
        if block.users == 0:
            collection.remove(block)


def _irises(obj) -> tuple[float, float]:
    """Radii of both irises in metres: those that were filmed, where they were seen."""
    seen = mesh.filmed_eyes(obj, load())
    radii = [eye.iris_radius for eye in seen.eyes] if seen is not None else [0.0, 0.0]
    return tuple(radius if radius > 0 else shapes.IRIS_M for radius in radii)
