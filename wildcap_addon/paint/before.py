# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Artist's state before painting: canvas, stencil, symmetry, views, active object, selection and mode.

It consists of names and plain values: an undo replaces every data-block, and a .blend saved during painting stores it
as JSON.
"""

import contextlib

import bpy

from . import view

_IMAGES = ("canvas", "stencil_image", "clone_image")
_SETTINGS = ("mode", "use_stencil_layer", "stencil_color", "invert_stencil", "use_clone_layer", *_IMAGES)
MODES = {'PAINT_WEIGHT': 'WEIGHT_PAINT', 'PAINT_VERTEX': 'VERTEX_PAINT', 'PAINT_TEXTURE': 'TEXTURE_PAINT'}
"""Mode of a context -> its name for mode_set, if that differs."""


def remember(context, head: bpy.types.Object) -> dict:
    """Return the state before painting on `head`."""
    paint = context.scene.tool_settings.image_paint
    active = context.view_layer.objects.active
    return {
        "paint": {name: _plain(getattr(paint, name)) for name in _SETTINGS},
        "views": view.remember(context.screen) if context.screen is not None else [],
        "mode": context.mode,
        "active": active.name if active else "",
        "selected": [o.name for o in context.view_layer.objects if o.select_get()],
        "head": head.name,
        "mirrored": head.data.use_mirror_x,
        "pose": [head.show_only_shape_key, head.active_shape_key_index],
    }


def at_rest(head: bpy.types.Object) -> None:
    """Show the head without its expression, as it was solved: a stroke must not land on eyes or teeth."""
    if head.data.shape_keys is not None:
        head.active_shape_key_index, head.show_only_shape_key = 0, True


def put_back(context, before: dict) -> None:
    """Restore the state, from Object Mode; what was deleted meanwhile is skipped."""
    paint = context.scene.tool_settings.image_paint
    for name, value in before["paint"].items():
        setattr(paint, name, bpy.data.images.get(value or "") if name in _IMAGES else value)
    view.restore(before["views"])
    head = bpy.data.objects.get(before.get("head", ""))
    if head is not None:
        head.data.use_mirror_x = before["mirrored"]
        head.show_only_shape_key, head.active_shape_key_index = before.get("pose", (False, 0))
    objects = context.view_layer.objects
    for thing in list(objects):
        thing.select_set(thing.name in before["selected"])
    objects.active = objects.get(before["active"])
    mode = 'EDIT' if before["mode"].startswith("EDIT_") else MODES.get(before["mode"], before["mode"])
    if mode != 'OBJECT' and objects.active is not None:
        with contextlib.suppress(TypeError, RuntimeError):  # the object no longer has that mode
            bpy.ops.object.mode_set(mode=mode)


def _plain(value):
    if isinstance(value, bpy.types.Image):
        return value.name
    return value if isinstance(value, (str, bool, type(None))) else tuple(value)
