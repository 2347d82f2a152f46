# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: material and render."""

import bpy

from ..base_panel import CapturePanel


class WILDCAP_PT_relight(CapturePanel, bpy.types.Panel):
    bl_label = "Relight"
    bl_order = 50

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        props = context.scene.wildcap
        layout.operator("wildcap.assemble_material")
        layout.prop(props, "light")
        layout.prop(props, "resolution")
        layout.prop(props, "samples")
        layout.operator("wildcap.render")


CLASSES = (WILDCAP_PT_relight,)
