# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: material, what is compared, light and renders."""

import bpy

from ..base_panel import CapturePanel
from . import compare


class WILDCAP_PT_relight(CapturePanel, bpy.types.Panel):
    bl_label = "Relight"
    bl_order = 50

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        props = context.scene.wildcap
        layout.operator("wildcap.assemble_material")
        row = layout.row(align=True)
        now = compare.shown(context)
        for kind, (label, _, _) in compare.SHOWN.items():
            row.operator("wildcap.compare", text=label, depress=kind == now).show = kind
        layout.prop(props, "light")
        if props.light == 'hdri':
            for name in ("hdri", "hdri_file", "hdri_strength"):
                layout.prop(props, name)
        layout.prop(props, "hdri_rotation")
        column = layout.column(align=True)
        column.prop(props, "resolution")
        column.prop(props, "samples")
        layout.row().prop(props, "view", expand=True)
        row = layout.row(align=True)
        row.operator("wildcap.render")
        row.operator("wildcap.contact_sheet")
        header, body = layout.panel("wildcap_turntable", default_closed=True)
        header.label(text="Turntable")
        if body:
            body.row().prop(props, "turns", expand=True)
            body.prop(props, "turn_frames")
            body.row().prop(props, "turn_file", expand=True)
            body.operator("wildcap.turntable", text="Render Turntable")


CLASSES = (WILDCAP_PT_relight,)
