# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the face units: add and rest them, the iris, the gaze, the close-up."""

import bpy

from ...core.capture.messages import Problem
from .. import captures, head
from ..base_operator import HeadOperator
from . import gaze, materials, mesh
from .close_up import building

FILMED = ("filmed", "As Filmed", "What the frames show, where the eyes were open; brown otherwise")
IRIS = {
    "name": "Iris",
    "description": "Colour of the eyes",
    "items": [FILMED, *((name, name.title(), "") for name in materials.IRISES)],
}


class WILDCAP_OT_add_face_units(HeadOperator, bpy.types.Operator):
    """Open the head's lips and lids, put eyes and a mouth behind them, and give it ARKit's face units as shape keys"""

    bl_idname = "wildcap.add_face_units"
    bl_label = "Add Face Units"
    bl_options = {'REGISTER', 'UNDO'}

    iris: bpy.props.EnumProperty(**IRIS)

    def work(self, context):
        item = captures.require(context)
        obj = captures.require_head(context, item)
        if mesh.has(obj):
            raise Problem(
                "This head has its face units already.",
                "Move their sliders, here or under Shape Keys in the mesh's properties.",
            )
        mesh.add(obj, "" if self.iris == FILMED[0] else self.iris)
        head.complete(obj, captures.folder(item))


class WILDCAP_OT_iris(HeadOperator, bpy.types.Operator):
    """Colour of the eyes"""

    bl_idname = "wildcap.iris"
    bl_label = "Iris"
    bl_options = {'REGISTER', 'UNDO'}

    iris: bpy.props.EnumProperty(**IRIS)

    def work(self, context):
        obj = _acting(context)
        materials.recolour(obj, mesh.filmed_iris(obj) if self.iris == FILMED[0] else self.iris)


class WILDCAP_OT_rest_face(HeadOperator, bpy.types.Operator):
    """Set all face units back to zero and the lids to where they were filmed"""

    bl_idname = "wildcap.rest_face"
    bl_label = "Rest"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        mesh.rest(_acting(context))


class _Toggle(HeadOperator):
    """Mixin: adds to the head what the module `switched` makes, or removes it."""

    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        obj = _acting(context)
        if self.switched.of(obj):
            self.switched.remove(obj)
        elif mesh.is_complete(obj):
            self.switched.add(context, obj)
        else:
            raise Problem(
                "This head lost vertices or face units since it got them.",
                "Undo that, or delete the head, click Bring In Head and Add Face Units, then this.",
            )


class WILDCAP_OT_gaze(_Toggle, bpy.types.Operator):
    """Have both eyes look at an empty before the face, to be moved and animated; click again to get the sliders back"""

    bl_idname = "wildcap.gaze"
    bl_label = "Gaze"
    switched = gaze


class WILDCAP_OT_close_up(_Toggle, bpy.types.Operator):
    """Give the head eyes and a mouth worth a close-up, as objects of their own that go along with its face units; click
    again to get the plain ones back"""

    bl_idname = "wildcap.close_up"
    bl_label = "Close-Up Eyes"
    switched = building


def _acting(context):
    """Return the capture's head with face units. Raises Problem if it has none."""
    obj = captures.require_head(context, captures.require(context))
    if not mesh.has(obj):
        raise Problem("This head has no face units yet.", "Click Add Face Units.")
    return obj


CLASSES = (WILDCAP_OT_add_face_units, WILDCAP_OT_iris, WILDCAP_OT_gaze, WILDCAP_OT_close_up, WILDCAP_OT_rest_face)
