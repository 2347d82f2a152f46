# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of the face units, with the sliders one tries first; all are under Shape Keys in the mesh's properties."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import captures
from ..base_panel import CapturePanel
from . import gaze, mesh
from .close_up import building

FIRST = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft", "eyeBlinkRight", "browInnerUp")


class WILDCAP_PT_acting(CapturePanel, bpy.types.Panel):
    bl_label = "Face Units"
    bl_order = 55

    def draw(self, context):
        layout = self.layout
        obj = captures.head(context, captures.active(context))
        if obj is None or not mesh.has(obj):
            layout.operator("wildcap.add_face_units")
            return
        keys = obj.data.shape_keys
        column = layout.column(align=True)
        if mesh.OPEN in keys:
            column.prop(keys, f'["{mesh.OPEN}"]', text=iface_("Eyes Open"), slider=True)
        for name in FIRST:
            key = keys.key_blocks.get(name)
            if key is not None:
                column.prop(key, "value", text=name, slider=True, translate=False)
        row = layout.row()
        row.operator_menu_enum("wildcap.iris", "iris")
        row.operator("wildcap.gaze", depress=gaze.of(obj) is not None)
        row.operator("wildcap.rest_face")
        layout.operator("wildcap.close_up", depress=bool(building.of(obj)))


CLASSES = (WILDCAP_PT_acting,)
