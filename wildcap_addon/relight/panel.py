# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of material, comparison, light and renders."""

import bpy

from ..base_panel import CapturePanel, narrow
from . import compare


class WILDCAP_PT_relight(CapturePanel, bpy.types.Panel):
    bl_label = "Relight"
    bl_order = 50

    def draw(self, context):
        layout = self.layout
        tight = narrow(context)
        layout.use_property_split = not tight
        layout.use_property_decorate = False
        props = context.scene.wildcap
        layout.operator("wildcap.assemble_material")
        buttons = side_by_side(layout, tight)
        now = compare.shown_picture(context)
        for kind, (label, _, _) in compare.SHOWN.items():
            if kind != 'SKIN':  # in the panel of the hair
                buttons.operator("wildcap.compare", text=label, depress=kind == now).show = kind
        layout.prop(props, "light", text="" if tight else None)
        if props.light == 'hdri':
            layout.prop(props, "hdri", text="" if tight else None)
            layout.prop(props, "hdri_file", text="" if tight else None, placeholder="Own File" if tight else None)
            layout.prop(props, "hdri_strength")
        layout.prop(props, "hdri_rotation")
        column = layout.column(align=True)
        column.prop(props, "resolution")
        column.prop(props, "samples")
        layout.row().prop(props, "view", expand=True)
        layout.prop(props, "exposure")
        layout.operator("wildcap.expose")
        buttons = side_by_side(layout, tight)
        buttons.operator("wildcap.render")
        buttons.operator("wildcap.contact_sheet")
        header, body = layout.panel("wildcap_turntable", default_closed=True)
        header.label(text="Turntable")
        if body:
            body.row().prop(props, "turns", expand=True)
            body.prop(props, "turn_frames")
            body.row().prop(props, "turn_file", expand=True)
            body.operator("wildcap.turntable", text="Render Turntable")


def side_by_side(layout, tight: bool):
    """Return a row for buttons that belong together, a column if the sidebar is narrow."""
    return layout.column(align=True) if tight else layout.row(align=True)


CLASSES = (WILDCAP_PT_relight,)
