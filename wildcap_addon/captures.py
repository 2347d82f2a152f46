# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which capture the panel and the operators mean: that of the active head, or the one chosen in the scene's list."""

from functools import lru_cache
from pathlib import Path

import bpy

from ..core.capture.capture import Capture
from ..core.capture.messages import Problem

HEAD_KEY = "wildcap_capture"
"""Custom property of a head object: its capture's folder."""
ASIDE_KEY = "wildcap_aside"
"""Custom property of a head that has made room for another one, until its row is clicked."""
HAIR_KEY = "wildcap_hair"
"""Custom property of hair curves that were grown on a head: of which part they are."""
CLOSE_UP_KEY = "wildcap_close_up"
"""Custom property of the objects of a head's close-up eyes and mouth: what each is."""
HAIR_COLOUR = "wildcap_colour"
"""Their attribute of each curve: its albedo, in the scene's working space."""


def active(context) -> bpy.types.PropertyGroup | None:
    """The item of the active head, or of the head whose child is active, in the scene's list; else the list's active
    one, else None."""
    props = context.scene.wildcap
    path = _path(context.view_layer.objects.active if context.view_layer else None)
    for item in props.captures if path else ():
        if item.path == path:
            return item
    return props.captures[props.active_index] if 0 <= props.active_index < len(props.captures) else None


def _path(thing: bpy.types.Object | None) -> str | None:
    """The capture's folder of what an object belongs to: itself, or what it is a child of, as hair and eyes are of a
    head."""
    while thing is not None and HEAD_KEY not in thing:
        thing = thing.parent
    return thing[HEAD_KEY] if thing is not None else None


def require(context) -> bpy.types.PropertyGroup:
    """As `active`. Raises Problem when there is none."""
    item = active(context)
    if item is None:
        raise Problem("There is no face to work on yet.", "Choose a video, or open the sample head.")
    return item


def folder(item) -> Capture:
    """The item's capture; `links` sees to it that the path leads there. Asks no disk: panels call this when they
    draw."""
    return _at(bpy.path.abspath(item.path))


@lru_cache(maxsize=64)  # a drawing of all panels asks some thirty times, and each would name fifty files anew
def _at(path: str) -> Capture:
    return Capture(Path(path))


def root(item) -> str:
    """The key under which run-time state about a capture is kept; '' for none."""
    return str(folder(item).root) if item is not None else ""


def listed() -> list:
    """The captures of all scenes of this file."""
    return [item for scene in bpy.data.scenes for item in scene.wildcap.captures]


def add(context, path: Path) -> bpy.types.PropertyGroup:
    """The list's item for a folder, made if need be, and now the active one."""
    props = context.scene.wildcap
    index = next((i for i, item in enumerate(props.captures) if item.path == str(path)), None)
    if index is None:
        item = props.captures.add()
        item.name, item.path = Path(path).stem, str(path)
        index = len(props.captures) - 1
    props.active_index = index
    if _path(context.view_layer.objects.active) not in (None, str(path)):
        context.view_layer.objects.active = None  # or the other head would keep its capture active
    return props.captures[index]


def choose(context) -> None:
    """After a click in the list: that capture's head becomes the active object, or at least no other capture's stays
    it, for the active head decides. Only in Object Mode: nobody is thrown out of a stroke."""
    props = context.scene.wildcap
    if context.view_layer is None or context.mode != 'OBJECT' or not 0 <= props.active_index < len(props.captures):
        return
    item, objects = props.captures[props.active_index], context.view_layer.objects
    wanted = head(context, item)
    if wanted is not None and wanted.name in objects:
        show_again(wanted)
        for thing in objects:
            if thing == wanted or HEAD_KEY in thing:
                thing.select_set(thing == wanted)
        objects.active = wanted
    elif _path(objects.active) not in (None, item.path):
        objects.active = None


def put_aside(obj: bpy.types.Object) -> None:
    """Hides a head and what it wears; what is hidden is the artist's own doing."""
    for thing in (obj, *worn(obj)):
        if not thing.hide_get():
            thing.hide_set(True)
            thing[ASIDE_KEY] = True


def show_again(obj: bpy.types.Object) -> None:
    """Shows a head that was put aside, and what it wears."""
    for thing in (obj, *worn(obj)):
        if thing.pop(ASIDE_KEY, None):
            thing.hide_set(False)


def hair(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The hair curves that were grown on a head."""
    return [child for child in obj.children if child.type == 'CURVES' and HAIR_KEY in child]


def close_up(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects of a head's close-up eyes and mouth."""
    return [child for child in obj.children if child.type == 'MESH' and CLOSE_UP_KEY in child]


def worn(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """What is shown wherever the head is."""
    return hair(obj) + close_up(obj)


def head(context, item) -> bpy.types.Object | None:
    """The capture's head, if it is in this scene."""
    return item.head if item.head is not None and item.head.name in context.scene.objects else None


def require_head(context, item) -> bpy.types.Object:
    head_object = head(context, item)
    if head_object is None:
        raise Problem(
            "The head is not in this scene.", "Click Bring In Head; if it was never reconstructed, click Reconstruct."
        )
    return head_object


def require_shown(context, obj: bpy.types.Object) -> None:
    """Raises Problem where the head is in the scene, but not in the view layer, where alone an object can be active."""
    if obj.name not in context.view_layer.objects:
        raise Problem(
            "The head is in a collection that is excluded from this view layer.",
            "Tick that collection in the Outliner.",
        )
