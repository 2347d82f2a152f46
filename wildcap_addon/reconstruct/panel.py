# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: the settings of the stages up to the mask proposal."""

import bpy

from ...core import stages
from .. import captures
from ..base_panel import CapturePanel, draw_settings
from . import landmarks


class WILDCAP_PT_reconstruct(CapturePanel, bpy.types.Panel):
    bl_label = "Reconstruction"
    bl_order = 20

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        item = captures.active(context)
        layout.prop(item, "quality")
        row = layout.row(align=True)
        row.operator("wildcap.reconstruct")
        row = layout.row(align=True)
        for name, icon in (("head", 'MESH_MONKEY'), ("cameras", 'CAMERA_DATA'), ("scan", 'OUTLINER_DATA_POINTCLOUD')):
            row.operator(f"wildcap.bring_in_{name}", text=name.title(), icon=icon)
        row = layout.row(align=True)
        row.operator("wildcap.hide_landmarks" if landmarks.shown() else "wildcap.show_landmarks", icon='EMPTY_AXIS')
        row.operator("wildcap.fit_landmarks")
        for stage in stages.STAGES[:stages.NAMES.index(stages.MASK_STAGE) + 1]:
            draw_settings(layout, item, stage)


CLASSES = (WILDCAP_PT_reconstruct,)
