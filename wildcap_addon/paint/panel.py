# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: where to paint the mask, and the brush while it is painted."""

import bpy

from ..base_panel import CapturePanel, WildcapPanel
from . import session
from .operators import EDITS


class WILDCAP_PT_painting(WildcapPanel, bpy.types.Panel):
    bl_label = "Painting"
    bl_order = 1
    bl_parent_id = "WILDCAP_PT_main"

    @classmethod
    def poll(cls, context):
        return session.active()

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        row.operator("wildcap.paint_mask", text="On the Head", depress=not session.on_sheet()).on = 'HEAD'
        row.operator("wildcap.paint_mask", text="On the Flat Sheet", depress=session.on_sheet()).on = 'SHEET'
        brush = context.scene.tool_settings.image_paint.brush
        if brush is not None:
            layout.prop(brush, "size", slider=True)
            layout.prop(brush, "strength", slider=True)
        layout.prop(context.scene.tool_settings.image_paint, "use_symmetry_x", text="Mirror Left and Right")
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for kind in EDITS:
            grid.operator("wildcap.edit_mask", text=kind.capitalize()).kind = kind
        layout.operator("wildcap.edit_mask", text="Back to Proposal", icon='LOOP_BACK').kind = 'PROPOSAL'


class WILDCAP_PT_mask(CapturePanel, bpy.types.Panel):
    bl_label = "Shadow Mask"
    bl_order = 30

    def draw(self, context):
        column = self.layout.column()
        column.operator("wildcap.paint_mask", text="Paint on the Head", icon='BRUSH_DATA').on = 'HEAD'
        column.operator("wildcap.paint_mask", text="Paint on the Flat Sheet", icon='MESH_PLANE').on = 'SHEET'


CLASSES = (WILDCAP_PT_painting, WILDCAP_PT_mask)
