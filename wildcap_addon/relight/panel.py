# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: material, what is compared, light and render."""

import bpy

from ..base_panel import CapturePanel
from . import compare


class WILDCAP_PT_relight(CapturePanel, bpy.types.Panel):
    bl_label = "Relight"
    bl_order = 50

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        props = context.scene.wildcap
        layout.operator("wildcap.assemble_material")
        row = layout.row(align=True)
        now = compare.shown(context)
        for kind, (label, _, _) in compare.SHOWN.items():
            row.operator("wildcap.compare", text=label, depress=kind == now).show = kind
        layout.prop(props, "light")
        if props.light == 'hdri':
            for name in ("hdri", "hdri_file", "hdri_rotation", "hdri_strength"):
                layout.prop(props, name)
        layout.prop(props, "resolution")
        layout.prop(props, "samples")
        layout.operator("wildcap.render")


CLASSES = (WILDCAP_PT_relight,)
