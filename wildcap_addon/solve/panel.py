# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: quality, skin tone and the solver's settings; the preview while it runs."""

import bpy

from ...core import stages
from .. import captures, jobs, properties, timings
from ..base_panel import CapturePanel, WildcapPanel, draw_settings
from . import preview


class WILDCAP_PT_preview(WildcapPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_order = 2
    bl_parent_id = "WILDCAP_PT_main"

    @classmethod
    def poll(cls, context):
        job = jobs.of(captures.root(captures.active(context)))
        return job is not None and job.goal == "solve" and job.previews > 0

    def draw(self, context):
        preview.draw(self.layout, captures.folder(captures.active(context)))


class WILDCAP_PT_solve(CapturePanel, bpy.types.Panel):
    bl_label = "Solve"
    bl_order = 40

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        item = captures.active(context)
        layout.prop(item, "quality")
        times = timings.words(properties.device(item))
        if times:
            layout.label(text=times, icon='TIME')
        layout.prop(item, "use_skin_tone")
        row = layout.row(align=True)
        row.active = item.use_skin_tone
        row.prop(item, "skin_tone")
        row.operator("wildcap.pick_skin_tone", text="", icon='EYEDROPPER')
        row.operator("wildcap.estimate_skin_tone")
        layout.prop(item, "device")
        layout.prop(item, "seed")
        row = layout.row(align=True)
        row.operator("wildcap.solve")
        row.operator("wildcap.solve_edited")
        if len(context.scene.wildcap.captures) > 1:
            layout.operator("wildcap.solve_all")
        for stage in stages.STAGES[stages.NAMES.index(stages.MASK_STAGE) + 1:]:
            draw_settings(layout, item, stage, without=("skin_tone",))


CLASSES = (WILDCAP_PT_preview, WILDCAP_PT_solve)
