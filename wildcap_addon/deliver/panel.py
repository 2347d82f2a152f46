# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of target program, mesh and file, what the file drops, and settings of the artist's own mesh and the scan."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import stages
from ...core.settings.delivery_presets import FORMATS, PICTURES, PRESETS
from .. import captures, problems
from ..base_panel import CapturePanel, draw_settings, region_width
from . import stand, waiting


class WILDCAP_PT_deliver(CapturePanel, bpy.types.Panel):
    bl_label = "Deliver"
    bl_order = 60

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        item = captures.active(context)
        settings, root = item.deliver, captures.root(item)
        for name in ("preset", "what", "format"):
            layout.prop(settings, name)
        preset = PRESETS[settings.preset]
        format_name = preset.format if settings.format == "preset" else settings.format
        chosen = FORMATS[format_name]
        unit = chosen.unit or preset.unit
        pictures = preset.pictures if settings.pictures == "preset" else settings.pictures
        text = iface_("{}, {}, {}").format(iface_(chosen.title), unit, iface_(PICTURES[pictures]))
        layout.label(text=text, translate=False, icon='FILE_3D')
        if waiting.ready(root) is not None:
            layout.operator("wildcap.finish_delivery", icon='EXPORT')
        layout.operator("wildcap.deliver", icon='EXPORT')
        if waiting.last(root) is not None:
            layout.operator("wildcap.open_delivery", icon='FILE_FOLDER')
        header, body = layout.panel("wildcap_deliver_drops", default_closed=False)
        header.label(text="Not Included")
        left_out = stand.left_behind(captures.head(context, item), settings.what, chosen.suffix)
        for sentence in (*chosen.drops, *left_out) if body else ():
            problems.draw_text(body, sentence, region_width(context), 'INFO')
        header, body = layout.panel("wildcap_deliver_maps", default_closed=True)
        header.label(text="Maps")
        for name in ("size", "pictures", "colour", "udim", "hair", "clean", "folder", "replace") if body else ():
            body.prop(settings, name)
        draw_settings(layout, item, stages.by_name("transfer"))
        if settings.what != "head":
            layout.operator("wildcap.reconstruct", text="Make Own Mesh and Scan", icon='FILE_REFRESH').to_end = True


CLASSES = (WILDCAP_PT_deliver,)
