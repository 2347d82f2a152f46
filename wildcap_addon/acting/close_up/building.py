# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up of a head as a whole: added, renewed when the head has another shape, and taken away again."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ... import captures, data_blocks, local_view
from .. import materials as of_the_head
from .. import mesh
from ..asset import load
from . import eyes, keeping, materials, mouth, nodes, pictures, shapes

KEY = captures.CLOSE_UP_KEY


def of(obj) -> list[bpy.types.Object]:
    """The objects of a head's close-up."""
    return captures.close_up(obj)


def add(context, obj) -> list[str]:
    """Makes the close-up, or renews it: objects that are there keep their materials, and what was set in them; those on
    which somebody modelled stay as they are. Returns the names of these."""
    made: list = []
    left: list[str] = []

    def keep(kind: str, data, finish):
        thing = next((child for child in of(obj) if child[KEY] == kind), None)
        if thing is not None and keeping.is_modelled(thing):
            bpy.data.meshes.remove(data)
            left.append(thing.name)
            return thing
        if thing is None:
            thing = bpy.data.objects.new(f"{obj.name} {kind}", data)
            for collection in obj.users_collection:
                collection.objects.link(thing)
            thing.parent, thing[KEY] = obj, kind
            made.append(thing)
        else:
            data_blocks.replace_data(thing, data, bpy.data.meshes)
        finish(thing)
        keeping.note(thing)
        return thing

    eyes.build(obj, keep, _irises(obj))
    mouth.build(obj, keep)
    materials.resize(of(obj), data_blocks.scale_of(obj))
    local_view.join(context, made)
    return left


def remove(obj) -> None:
    """Takes away what `add` made, and what of its materials, pictures and nodes nobody else uses."""
    modifier = obj.modifiers.get(nodes.LIDS)
    if modifier is not None:
        nodes.modify(obj, modifier.node_group, Lining=None)  # Blender 5.2 would go on counting it as a user
        obj.modifiers.remove(modifier)
    if nodes.SOCKET in obj.data.attributes:
        obj.data.attributes.remove(obj.data.attributes[nodes.SOCKET])
    things = of(obj)
    made = {
        slot.material
        for thing in things
        for slot in thing.material_slots
        if slot.material is not None and of_the_head.KEY in slot.material
    }
    data = [thing.data for thing in things]
    for thing in things:
        bpy.data.objects.remove(thing)
    _drop(bpy.data.meshes, data)
    _drop(bpy.data.materials, made)
    for blocks, names in (
        (bpy.data.images, (pictures.IRIS, pictures.WHITE)),
        (bpy.data.node_groups, (nodes.LIDS, nodes.MARGIN, nodes.WET, nodes.CARUNCLE)),
    ):
        _drop(blocks, filter(None, [data_blocks.find(blocks, name) for name in names]))


def keep_up(obj, _capture) -> str:
    """The close-up of a head that was reconstructed anew is made for its new shape; one of a head that was cut since,
    or lost a unit, stays as it is; one of a head that has its units no more goes. Returns what is to be told.
    `head.complete` asks."""
    left = []
    if of(obj) and mesh.is_complete(obj):
        left = add(bpy.context, obj)
    elif of(obj) and not mesh.has(obj):
        remove(obj)
    return (
        rpt_("{}: changed since, and left as they are; delete them to have them made anew").format(", ".join(left))
        if left
        else ""
    )


def _drop(collection, blocks) -> None:
    for block in blocks:
        if block.users == 0:
            collection.remove(block)


def _irises(obj) -> tuple[float, float]:
    """Radii of both irises in metres: those that were filmed, where they were seen."""
    seen = mesh.filmed_eyes(obj, load())
    radii = [eye.iris_radius for eye in seen.eyes] if seen is not None else [0.0, 0.0]
    return tuple(radius if radius > 0 else shapes.IRIS_M for radius in radii)
