# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel to grow hair, with the list of what was grown."""

import bpy

from .. import captures
from ..base_panel import CapturePanel
from . import curves


class WILDCAP_PT_groom(CapturePanel, bpy.types.Panel):
    bl_label = "Hair"
    bl_order = 56

    def draw(self, context):
        layout = self.layout
        layout.operator("wildcap.grow_hair")
        obj = captures.head(context, captures.active(context))
        hairs = curves.of(obj) if obj is not None else []
        if hairs:
            layout.operator("wildcap.compare", text="Show Skin Below").show = 'SKIN'
        for hair in hairs:
            row = layout.row(align=True)
            row.label(text=hair.name, icon='CURVES', translate=False)
            row.prop(hair, "hide_viewport", text="", emboss=False)
            row.prop(hair, "hide_render", text="", emboss=False)


CLASSES = (WILDCAP_PT_groom,)
