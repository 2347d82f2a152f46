# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist had before painting a mask: canvas, stencil, symmetry, shading, overlays, active object, selection and
mode; and how it comes back.

Names and plain values only: an undo replaces every data-block, and a .blend that is saved while a mask is painted keeps
them as JSON.
"""

import contextlib

import bpy

from . import view

_SETTINGS = ("mode", "canvas", "use_stencil_layer", "stencil_image", "stencil_color", "invert_stencil")
MODES = {'PAINT_WEIGHT': 'WEIGHT_PAINT', 'PAINT_VERTEX': 'VERTEX_PAINT', 'PAINT_TEXTURE': 'TEXTURE_PAINT'}
"""Of a context's mode, the name by which mode_set enters it, where it is another one."""


def remember(context, head: bpy.types.Object) -> dict:
    """To be called before anything is changed; `head` is what will be painted on."""
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
    """The head is painted as it was solved, whatever face it makes: a stroke must not land on eyes or teeth."""
    if head.data.shape_keys is not None:
        head.active_shape_key_index, head.show_only_shape_key = 0, True


def put_back(context, before: dict) -> None:
    """All of it, from Object Mode; what was deleted meanwhile is left out."""
    paint = context.scene.tool_settings.image_paint
    for name, value in before["paint"].items():
        setattr(paint, name, bpy.data.images.get(value or "") if name in ("canvas", "stencil_image") else value)
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
        with contextlib.suppress(TypeError, RuntimeError):  # the object of before cannot have that mode any more
            bpy.ops.object.mode_set(mode=mode)


def _plain(value):
    return (
        value.name
        if isinstance(value, bpy.types.Image)
        else value
        if isinstance(value, (str, bool, type(None)))
        else tuple(value)
    )
