# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two places to paint a mask, the head and the flat sheet, and the changes between them.

The scene decides which one is in use, as an undo may remove the sheet or bring it back.
"""

import bpy

from ...core.capture.messages import Problem
from .. import captures
from . import sheet, view


def follow_name(session) -> None:
    """Update the session if the head was renamed; its capture identifies it."""
    scene = bpy.data.scenes.get(session.scene)
    heads = [item.head for item in scene.wildcap.captures if captures.root(item) == session.root] if scene else []
    old, new = session.head, heads[0].name if heads and heads[0] is not None else session.head
    if new != old:
        before = session.before
        before["selected"] = [new if name == old else name for name in before["selected"]]
        before.update({key: new for key in ("active", "head") if before.get(key) == old})
        session.head = new


def turn(context, session, use_sheet: bool) -> None:
    """Change from the head to the sheet or back."""
    if use_sheet != sheet.is_there():
        leave(context, session)
        enter(context, session, use_sheet)


def enter(context, session, use_sheet: bool) -> None:
    """Enter Texture Paint on one of the two. Raises Problem if the head is missing."""
    if context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    target = bpy.data.objects.get(session.head)
    if target is None or target.name not in context.scene.objects:
        raise Problem("The head is no longer in this scene.", "Undo, or bring the head in again.")
    captures.require_shown(context, target)
    if use_sheet:
        target = sheet.make(context, context.scene.tool_settings.image_paint.canvas, target)
    face(session, use_sheet)
    context.view_layer.objects.active = target
    target.select_set(True)
    bpy.ops.object.mode_set(mode='TEXTURE_PAINT')


def leave(context, session) -> None:
    """Return to Object Mode on the head, without the sheet."""
    if context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    if sheet.is_there():
        sheet.remove(bpy.data.objects.get(session.head))
    face(session, False)
    obj = bpy.data.objects.get(session.head)
    if obj is not None and obj.name in context.view_layer.objects:
        context.view_layer.objects.active = obj
        obj.select_set(True)


def face(session, the_sheet: bool) -> None:
    """Turn the views to the sheet, or back from it."""
    if the_sheet and not session.faces_sheet:
        view.face_sheet(session.before["views"], (0, 0, 0), sheet.SIDE_M)
    elif session.faces_sheet and not the_sheet:
        view.face_head(session.before["views"])
    session.faces_sheet = the_sheet
