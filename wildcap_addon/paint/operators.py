# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: paint the shadow mask on the head or on the flat sheet, and leave with the mask saved."""

import bpy

from .. import captures
from ..base_operator import BaseOperator
from . import session


class WILDCAP_OT_paint_mask(BaseOperator, bpy.types.Operator):
    """Paint where the shadow is: red is shadow, Ctrl takes it away; on the head or on a flat sheet of its texture"""

    bl_idname = "wildcap.paint_mask"
    bl_label = "Paint Mask"
    bl_options = {'REGISTER', 'UNDO'}

    on: bpy.props.EnumProperty(
        name="On", items=[('HEAD', "Head", "Paint on the head"), ('SHEET', "Sheet", "Paint on the flat texture")], default='HEAD', options={'SKIP_SAVE'},
    )

    def work(self, context):
        session.begin(context, captures.require(context), self.on == 'SHEET')


class WILDCAP_OT_finish_mask(BaseOperator, bpy.types.Operator):
    """Save the mask to the capture and go back to Object Mode; everything else is as it was"""

    bl_idname = "wildcap.finish_mask"
    bl_label = "Save Mask and Leave"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return session.active()

    def work(self, context):
        session.end(context)


CLASSES = (WILDCAP_OT_paint_mask, WILDCAP_OT_finish_mask)
