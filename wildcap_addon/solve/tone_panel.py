# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel Skin Tone: ten swatches in the filmed hue, with the estimate marked, and what lies between them."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import freshness
from ...core.settings import skin_swatches
from ...core.settings.colour_values import SWATCHES, describe_estimate
from .. import captures, problems, status, tones
from ..base_operator import CaptureOperator
from ..base_panel import CapturePanel, region_width
from . import swatch_icons

PER_ROW = 5


class WILDCAP_OT_choose_swatch(CaptureOperator, bpy.types.Operator):
    """Give the head this skin tone: the head shows it at once, and every delivery has it, without another solve."""

    bl_idname = "wildcap.choose_swatch"
    bl_label = "Choose Skin Tone"
    bl_options = {'REGISTER', 'UNDO'}

    number: bpy.props.IntProperty(
        name="Swatch", min=1, max=SWATCHES, default=5, description="1 is the lightest measured skin, 10 the darkest"
    )

    def work(self, context):
        item = captures.require(context)
        tones.choose(item, _swatches(item)[self.number - 1])


class WILDCAP_PT_skin_tone(CapturePanel, bpy.types.Panel):
    bl_label = "Skin Tone"
    bl_order = 3
    bl_options = set()  # open: it is the one thing that no film tells for sure

    @classmethod
    def poll(cls, context):
        item = captures.active(context)
        capture_status = status.of(item) if item is not None else None
        return capture_status is not None and (
            capture_status.has_head or capture_status.stages.get("frames") in (*freshness.FINISHED, "stale", "absent")
        )

    def draw(self, context):
        layout, item = self.layout, captures.active(context)
        _draw_swatches(layout, item)
        layout.use_property_split = True
        layout.prop(item, "skin_warmth", slider=True)
        layout.prop(item, "use_skin_tone")
        row = layout.row(align=True)
        row.active = item.use_skin_tone
        row.prop(item, "skin_tone")
        row.operator("wildcap.pick_skin_tone", text="", icon='EYEDROPPER')
        row.operator("wildcap.estimate_skin_tone")
        problems.draw_text(layout, tone_words(item, status.of(item)), region_width(context), 'INFO')
        _draw_white_point(layout, item)


def _swatches(item) -> list[skin_swatches.Colour]:
    return skin_swatches.make_swatches(tones.person(item), tones.warmth(item))


def _draw_swatches(layout, item) -> None:
    estimated, current = tones.estimate(item), tones.current(item)
    within = skin_swatches.swatches_within(*estimated) if estimated else []
    nearest = skin_swatches.nearest_swatch(estimated[0]) if estimated else 0
    chosen = skin_swatches.nearest_swatch(current) if item.use_skin_tone else 0
    column = layout.column(align=True)
    for number, colour in enumerate(_swatches(item), 1):
        if number % PER_ROW == 1:
            row = column.row(align=True)
        button = row.operator(
            "wildcap.choose_swatch",
            text=str(number),
            icon_value=swatch_icons.icon(colour, number in within, number == nearest),
            depress=number == chosen,
        )
        button.number = number


def tone_words(item, capture_status: status.Status | None) -> str:
    """Describe the source of the skin tone and its uncertainty."""
    if item.use_skin_tone:
        return iface_("Chosen by you: this wins")
    estimated = tones.estimate(item)
    if estimated is not None and item.tone_source == "white point":
        return iface_("{}, ± {} L*, by {}").format(
            iface_(item.tone_group), round(item.tone_deviation), iface_(item.tone_source)
        )
    if estimated is not None:
        return " ".join(map(iface_, describe_estimate(estimated[1])))
    findings = capture_status.findings if capture_status else ()
    findings = [finding for finding in findings if finding["stage"] == "solve" and not finding["stopped"]]
    if findings:
        return " ".join(iface_(findings[-1][part]) for part in ("problem", "remedy"))
    return iface_("Estimated from the frames when the maps are solved")


def _draw_white_point(layout, item) -> None:
    """Draw the white point, and under a folded header the ways to measure it."""
    is_measured = item.solve.white_point != "auto"
    words = iface_("from the scene")
    if is_measured:
        words = ", ".join(band[:4] for band in item.solve.white_point.split(","))
    header, body = layout.panel("wildcap_white_point", default_closed=True)
    header.label(text=iface_("White Point: {}").format(words))
    if is_measured:
        header.operator("wildcap.clear_white_point", text="", icon='X')
    if body:
        body.operator("wildcap.find_color_checker")
        row = body.row(align=True)
        row.operator("wildcap.pick_white_point", text="Grey Card", icon='EYEDROPPER').card = 'grey'
        row.operator("wildcap.pick_white_point", text="White Paper", icon='EYEDROPPER').card = 'white'


CLASSES = (WILDCAP_OT_choose_swatch, WILDCAP_PT_skin_tone)
