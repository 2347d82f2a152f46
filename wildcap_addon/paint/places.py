# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the mask of a session is painted: on the head, or on the flat sheet; into Texture Paint on either, and back.
Which of them it is, the scene says, for an undo may take the sheet away or bring it back."""

import bpy

from ...core.capture.messages import Problem
from .. import captures
from . import sheet, view


def follow_name(session) -> None:
    """A head that was renamed since is known by its capture; the session then goes on by its new name."""
    scene = bpy.data.scenes.get(session.scene)
    heads = [item.head for item in scene.wildcap.captures if captures.root(item) == session.root] if scene else []
    old, new = session.head, heads[0].name if heads and heads[0] is not None else session.head
    if new != old:
        told = session.before
        told["selected"] = [new if name == old else name for name in told["selected"]]
        told.update({key: new for key in ("active", "head") if told.get(key) == old})
        session.head = new


def turn(context, session, use_sheet: bool) -> None:
    """From the head to the sheet or back."""
    if use_sheet != sheet.is_there():
        leave(context, session)
        enter(context, session, use_sheet)


def enter(context, session, use_sheet: bool) -> None:
    """Texture Paint on one of the two. Raises Problem when the head is gone."""
    if context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    target = bpy.data.objects.get(session.head)
    if target is None or target.name not in context.scene.objects:
        raise Problem("The head is not in this scene any more.", "Undo, or bring the head in again.")
    captures.require_shown(context, target)
    if use_sheet:
        target = sheet.make(context, context.scene.tool_settings.image_paint.canvas, target)
    face(session, use_sheet)
    context.view_layer.objects.active = target
    target.select_set(True)
    bpy.ops.object.mode_set(mode='TEXTURE_PAINT')


def leave(context, session) -> None:
    """Back to Object Mode on the head, the sheet gone."""
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
    """Turns the views to the sheet, or back from it."""
    if the_sheet and not session.faces_sheet:
        view.face_sheet(session.before["views"], (0, 0, 0), sheet.SIDE_M)
    elif session.faces_sheet and not the_sheet:
        view.face_head(session.before["views"])
    session.faces_sheet = the_sheet
