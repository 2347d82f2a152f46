# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: quality, skin tone and the solver's settings; the preview while it runs."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import stages
from ...core.settings.colour_values import describe_estimate
from .. import captures, jobs, problems, properties, status, timings
from ..base_panel import CapturePanel, WildcapPanel, draw_settings, region_width
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
        layout.prop(item, "use_skin_tone")
        row = layout.row(align=True)
        row.active = item.use_skin_tone
        row.prop(item, "skin_tone")
        row.operator("wildcap.pick_skin_tone", text="", icon='EYEDROPPER')
        row.operator("wildcap.estimate_skin_tone")
        problems.draw_text(layout, tone_words(item, status.of(item)), region_width(context), 'INFO')
        _draw_white_point(layout, item)
        layout.prop(item.solve, "together")
        layout.prop(item, "device")
        layout.prop(item, "seed")
        row = layout.row(align=True)
        row.operator("wildcap.solve")
        row.operator("wildcap.solve_edited")
        for stage in stages.STAGES[stages.NAMES.index(stages.MASK_STAGE) + 1 :]:
            if stage.name != "transfer":  # shown under Deliver
                draw_settings(layout, item, stage, without=("skin_tone", "white_point", "together"))


def tone_words(item, capture_status: status.Status | None) -> str:
    """Describe the source of the skin tone and its uncertainty."""
    if not item.use_skin_tone:
        findings = capture_status.findings if capture_status else ()
        findings = [finding for finding in findings if finding["stage"] == "solve" and not finding["stopped"]]
        if findings:
            return " ".join(iface_(findings[-1][part]) for part in ("problem", "remedy"))
        return iface_("Estimated from the frames when the maps are solved")
    if max(abs(a - b) for a, b in zip(item.skin_tone, item.estimated_tone, strict=True)) > 1e-4:
        return iface_("Chosen by you: this wins")
    if item.tone_source != "white point":
        return " ".join(map(iface_, describe_estimate(item.tone_deviation)))
    return iface_("{}, ± {} L*, by {}").format(
        iface_(item.tone_group), round(item.tone_deviation), iface_(item.tone_source)
    )


def _draw_white_point(layout, item) -> None:
    is_measured = item.solve.white_point != "auto"
    row = layout.row(align=True)
    words = iface_("from the scene")
    if is_measured:
        words = ", ".join(band[:4] for band in item.solve.white_point.split(","))
    row.label(text=iface_("White Point: {}").format(words))
    if is_measured:
        row.operator("wildcap.clear_white_point", text="", icon='X')
    layout.operator("wildcap.find_color_checker")
    row = layout.row(align=True)
    row.operator("wildcap.pick_white_point", text="Grey Card", icon='EYEDROPPER').card = 'grey'
    row.operator("wildcap.pick_white_point", text="White Paper", icon='EYEDROPPER').card = 'white'


CLASSES = (WILDCAP_PT_preview, WILDCAP_PT_solve)
