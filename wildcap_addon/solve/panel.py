# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: quality and the solver's settings; the preview while it runs."""

import bpy

from ...core.capture import stages
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
        return job is not None and job.goal in ("solve", "make") and job.previews > 0

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
        # before the devices are tried: the CPU always exists
        times = timings.describe_minutes(properties.device(item).replace("auto", "cpu"))
        if times:
            layout.label(text=times, icon='TIME')
        layout.prop(item.solve, "together")
        layout.prop(item, "device")
        layout.prop(item, "seed")
        row = layout.row(align=True)
        row.operator("wildcap.solve")
        row.operator("wildcap.solve_edited")
        for stage in stages.STAGES[stages.NAMES.index(stages.MASK_STAGE) + 1 :]:
            if stage.name not in ("transfer", "retouch"):  # under Deliver, and without settings
                draw_settings(layout, item, stage, without=("skin_tone", "white_point", "together"))


CLASSES = (WILDCAP_PT_preview, WILDCAP_PT_solve)
