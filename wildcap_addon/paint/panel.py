# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: where to paint a mask, and the brush and edits during painting."""

import bpy

from .. import captures
from ..base_panel import CapturePanel, WildcapPanel
from . import session
from .layer_panel import draw_painting
from .operators import EDITS


class WILDCAP_PT_painting(WildcapPanel, bpy.types.Panel):
    bl_label = "Painting"
    bl_order = 1
    bl_parent_id = "WILDCAP_PT_main"

    @classmethod
    def poll(cls, context):
        return session.active()

    def draw(self, context):
        if session.layer() is not None:
            draw_painting(self.layout, context)
        else:
            draw_mask(self.layout, context)


class WILDCAP_PT_mask(CapturePanel, bpy.types.Panel):
    bl_label = "Masks"
    bl_order = 30

    def draw(self, context):
        column = self.layout.column()
        column.operator("wildcap.paint_mask", text="Paint on the Head", icon='BRUSH_DATA').on = 'HEAD'
        column.operator("wildcap.paint_mask", text="Paint on the Flat Sheet", icon='MESH_PLANE').on = 'SHEET'
        column.operator("wildcap.paint_mask", text="Protect Moles and Scars", icon='LOCKED').mask = 'PROTECT'


def draw_mask(layout, context) -> None:
    """Draw the brush and the edits of a mask's painting."""
    column = layout.column(align=True)
    now = {"mask": session.painted_kind(), "on": 'SHEET' if session.on_sheet() else 'HEAD'}
    for name, choices in (
        ("mask", (("Shadow", 'SHADOW'), ("Protect", 'PROTECT'))),
        ("on", (("On the Head", 'HEAD'), ("On the Flat Sheet", 'SHEET'))),
    ):
        row = column.row(align=True)
        for text, value in choices:
            options = {**now, name: value}
            button = row.operator("wildcap.paint_mask", text=text, depress=options == now)
            button.mask, button.on = options["mask"], options["on"]
    brush = context.scene.tool_settings.image_paint.brush
    if brush is not None:
        layout.prop(brush, "size", slider=True)
        layout.prop(brush, "strength", slider=True)
    row = layout.row(align=True)
    row.prop(context.scene.tool_settings.image_paint, "stencil_color", text="")
    if context.space_data is not None:
        row.prop(context.space_data.overlay, "texture_paint_mode_opacity", text="Tint", slider=True)
    if context.object is not None and context.object.type == 'MESH':  # a stroke follows its mesh's symmetry
        layout.prop(context.object.data, "use_mirror_x", text="Mirror Left and Right")
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    for kind in EDITS:
        grid.operator("wildcap.edit_mask", text=kind.capitalize()).kind = kind
    if session.painted_kind() == 'SHADOW':
        row = layout.row(align=True)
        row.operator("wildcap.detect_mask", icon='VIEWZOOM')
        row.operator("wildcap.snap_mask", icon='SNAP_ON')
        item = captures.active(context)
        if item is not None:
            column = layout.column(align=True)
            column.label(text=item.shadow_mask.bl_rna.properties["softened"].name)
            column.prop(item.shadow_mask, "softened", text="")
        offer = session.offered()
        if offer == 'SNAPPED':
            take = layout.operator("wildcap.edit_mask", text="Use Snapped Mask", icon='CHECKMARK', depress=True)
            take.kind = offer
        text = "Use Detected Mask" if offer == 'PROPOSAL' else "Back to Proposal"
        back = layout.operator("wildcap.edit_mask", text=text, icon='LOOP_BACK', depress=offer == 'PROPOSAL')
        back.kind = 'PROPOSAL'


CLASSES = (WILDCAP_PT_painting, WILDCAP_PT_mask)
