# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Capture that panels and operators act on: that of the active head, or the active one of the scene's list."""

from functools import lru_cache
from pathlib import Path

import bpy

from ..core.capture.capture import Capture
from ..core.capture.messages import Problem

HEAD_KEY = "wildcap_capture"
"""Custom property of a head object: its capture's folder."""
ASIDE_KEY = "wildcap_aside"
"""Custom property of a head that is hidden in favour of another one until its row is clicked."""
HAIR_KEY = "wildcap_hair"
"""Custom property of hair curves grown on a head: the part that they belong to."""
CLOSE_UP_KEY = "wildcap_close_up"
"""Custom property of the objects of a head's close-up eyes and mouth: their kind."""
HAIR_COLOUR = "wildcap_colour"
"""Curve attribute of hair: its albedo in the scene's working space."""

NEW_VIEW = 'AgX'
"""View transform of a scene that gets its first capture, Blender's own default; the property's is that of old files."""


def active(context) -> bpy.types.PropertyGroup | None:
    """Return the list's item of the active head, or of the head whose child is active; else the list's active item."""
    props = context.scene.wildcap
    path = _path(context.view_layer.objects.active if context.view_layer else None)
    for item in props.captures if path else ():
        if item.path == path:
            return item
    return props.captures[props.active_index] if 0 <= props.active_index < len(props.captures) else None


def _path(thing: bpy.types.Object | None) -> str | None:
    """Return the capture's folder of a head, or of the head that an object is a child of, like hair and eyes."""
    while thing is not None and HEAD_KEY not in thing:
        thing = thing.parent
    return thing[HEAD_KEY] if thing is not None else None


def require(context) -> bpy.types.PropertyGroup:
    """Return the active item. Raises Problem if there is none."""
    item = active(context)
    if item is None:
        raise Problem("There is no face to work on yet.", "Choose a video, or open the sample head.")
    return item


def folder(item) -> Capture:
    """Return the item's capture without touching the disk: panels call this when they draw."""
    return _at(bpy.path.abspath(item.path))


@lru_cache(maxsize=64)  # drawing all panels asks some thirty times, and a Capture names fifty files
def _at(path: str) -> Capture:
    return Capture(Path(path))


def root(item) -> str:
    """Return the key of run-time state about a capture, its folder; '' for none."""
    return str(folder(item).root) if item is not None else ""


def listed() -> list:
    """Return the items of all scenes of this file."""
    return [item for scene in bpy.data.scenes for item in scene.wildcap.captures]


def of_root(root_folder: str) -> list:
    """Return the items of a capture in all scenes."""
    return [item for item in listed() if root(item) == root_folder]


def add(context, path: Path) -> bpy.types.PropertyGroup:
    """Return the list's item for a folder, made if necessary, and now the active one."""
    props = context.scene.wildcap
    index = next((i for i, item in enumerate(props.captures) if item.path == str(path)), None)
    if index is None:
        if not props.captures and not props.is_property_set("view"):
            props.view = NEW_VIEW
        item = props.captures.add()
        item.name, item.path = Path(path).stem, str(path)
        index = len(props.captures) - 1
    props.active_index = index
    if _path(context.view_layer.objects.active) not in (None, str(path)):
        context.view_layer.objects.active = None  # or the other head would keep its capture active
    return props.captures[index]


def remove(props, index: int, active_index: int) -> None:
    """Remove an item from a scene's list; `active_index` is the active one afterwards, as far as there are so many."""
    props.captures.remove(index)
    props.active_index = max(0, min(active_index, len(props.captures) - 1))


def choose(context) -> None:
    """Activate the head of the row that was clicked, or at least no other capture's head, as the active head decides.

    Only in Object Mode: a click must not interrupt a stroke.
    """
    props = context.scene.wildcap
    if context.view_layer is None or context.mode != 'OBJECT' or not 0 <= props.active_index < len(props.captures):
        return
    item, objects = props.captures[props.active_index], context.view_layer.objects
    obj = head(context, item)
    if obj is not None and obj.name in objects:
        show_again(obj)
        for thing in objects:
            if thing == obj or HEAD_KEY in thing:
                thing.select_set(thing == obj)
        objects.active = obj
    elif _path(objects.active) not in (None, item.path):
        objects.active = None


def put_aside(obj: bpy.types.Object) -> None:
    """Hide a head and what it wears, until `show_again`; objects that the artist has hidden stay so."""
    for thing in (obj, *worn(obj)):
        if not thing.hide_get():
            thing.hide_set(True)
            thing[ASIDE_KEY] = True


def show_again(obj: bpy.types.Object) -> None:
    """Show a head that was put aside, and what it wears."""
    for thing in (obj, *worn(obj)):
        if thing.pop(ASIDE_KEY, None):
            thing.hide_set(False)


def hair(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the hair curves that were grown on a head."""
    return [child for child in obj.children if child.type == 'CURVES' and HAIR_KEY in child]


def close_up(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the objects of a head's close-up eyes and mouth."""
    return [child for child in obj.children if child.type == 'MESH' and CLOSE_UP_KEY in child]


def worn(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the objects that are shown wherever the head is."""
    return hair(obj) + close_up(obj)


def head(context, item) -> bpy.types.Object | None:
    """Return the capture's head if it is in this scene."""
    return item.head if item.head is not None and item.head.name in context.scene.objects else None


def require_head(context, item) -> bpy.types.Object:
    """Return the capture's head. Raises Problem if it is not in this scene."""
    obj = head(context, item)
    if obj is None:
        raise Problem(
            "The head is not in this scene.", "Click Bring In Head; if it was never reconstructed, click Reconstruct."
        )
    return obj


def require_shown(context, obj: bpy.types.Object) -> None:
    """Raise Problem if an object is not in the view layer, where alone it can be active."""
    if obj.name not in context.view_layer.objects:
        raise Problem(
            "The head is in a collection that is excluded from this view layer.",
            "Tick that collection in the Outliner.",
        )
