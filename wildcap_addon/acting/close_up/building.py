# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Add the close-up of a head, renew it for another shape, and remove it."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ... import captures, data_blocks, local_view
from .. import materials as head_materials
from .. import mesh
from . import eyes, keeping, materials, mouth, nodes, pictures, shapes

KEY = captures.CLOSE_UP_KEY


def of(obj) -> list[bpy.types.Object]:
    """Return the objects of a head's close-up."""
    return captures.close_up(obj)


def add(context, obj) -> list[str]:
    """Make the close-up, or renew it: existing objects keep their materials and settings.

    Objects on which somebody modelled stay as they are; returns their names.
    """
    new: list[bpy.types.Object] = []
    modelled: list[str] = []

    def keep(kind: str, data, finish):
        thing = next((child for child in of(obj) if child[KEY] == kind), None)
        if thing is not None and keeping.is_modelled(thing):
            bpy.data.meshes.remove(data)
            modelled.append(thing.name)
            return thing
        if thing is None:
            thing = data_blocks.new_child(obj, f"{obj.name} {kind}", data)
            thing[KEY] = kind
            new.append(thing)
        else:
            data_blocks.replace_data(thing, data, bpy.data.meshes)
        finish(thing)
        keeping.note(thing)
        return thing

    eyes.build(obj, keep, _iris_radii(obj))
    mouth.build(obj, keep)
    materials.resize(of(obj), data_blocks.scale_of(obj))
    local_view.join(context, new)
    return modelled


def remove(obj) -> None:
    """Remove what `add` made, and those of its materials, pictures and nodes that nobody else uses."""
    modifier = obj.modifiers.get(nodes.LIDS)
    if modifier is not None:
        nodes.modify(obj, modifier.node_group, Lining=None)  # Blender 5.2 would go on counting it as a user
        obj.modifiers.remove(modifier)
    if nodes.SOCKET in obj.data.attributes:
        obj.data.attributes.remove(obj.data.attributes[nodes.SOCKET])
    things = of(obj)
    own, data = head_materials.of_kind(things), [thing.data for thing in things]
    for thing in things:
        bpy.data.objects.remove(thing)
    _drop(bpy.data.meshes, data)
    _drop(bpy.data.materials, own)
    for blocks, names in (
        (bpy.data.images, (pictures.IRIS, pictures.WHITE)),
        (bpy.data.node_groups, (nodes.LIDS, nodes.MARGIN, nodes.WET, nodes.CARUNCLE)),
    ):
        _drop(blocks, filter(None, [data_blocks.find(blocks, name) for name in names]))


def keep_up(obj, _capture) -> str:
    """Renew the close-up for the head's new shape, or remove it from a head without face units (head.COMPLETERS).

    That of a head that was cut or lost a unit stays. Returns a notice for the artist.
    """
    modelled = []
    if of(obj) and mesh.is_complete(obj):
        modelled = add(bpy.context, obj)
    elif of(obj) and not mesh.has(obj):
        remove(obj)
    if not modelled:
        return ""
    return rpt_("{}: changed since, and left as they are; delete them to have them made anew").format(
        ", ".join(modelled)
    )


def _drop(collection, blocks) -> None:
    for block in blocks:
        if block.users == 0:
            collection.remove(block)


def _iris_radii(obj) -> tuple[float, float]:
    """Return the filmed radii of both irises in metres, an adult's where there are none."""
    filmed = mesh.filmed_eyes(obj)
    radii = [eye.iris_radius for eye in filmed.eyes] if filmed is not None else [0.0, 0.0]
    return tuple(radius if radius > 0 else shapes.IRIS_M for radius in radii)
