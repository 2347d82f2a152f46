# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: the captures of this scene, and the frames of the active one."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .. import batches, captures
from ..base_panel import CapturePanel, FoldedPanel
from . import strip


class WILDCAP_UL_captures(bpy.types.UIList):
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        """Draw a capture's name, a mark on the one that the active head selects, and its state in the batch."""
        icon = 'CHECKMARK' if item == captures.active(context) else 'USER'
        layout.prop(item, "name", text="", emboss=False, icon=icon)
        face_state = batches.state_of(captures.root(item))
        if face_state is not None:
            layout.label(text="", icon=batches.ICONS[face_state.state])


class WILDCAP_PT_capture(FoldedPanel, bpy.types.Panel):
    bl_label = "Captures"
    bl_order = 10

    def draw(self, context):
        layout = self.layout
        props = context.scene.wildcap
        row = layout.row()
        row.template_list("WILDCAP_UL_captures", "", props, "captures", props, "active_index", rows=2)
        column = row.column(align=True)
        column.operator("wildcap.choose_video", text="", icon='ADD')
        column.operator("wildcap.open_capture", text="", icon='FILE_FOLDER')
        column.operator("wildcap.locate_capture", text="", icon='VIEWZOOM')
        column.operator("wildcap.close_capture", text="", icon='REMOVE')
        item = captures.active(context)
        if item is not None:
            row = layout.row()
            row.enabled = False  # only Locate may change the link, as other paths depend on it
            row.prop(item, "path", text="")
            row = layout.row(align=True)
            row.operator("wildcap.open_report", icon='URL')
            row.operator("wildcap.delete_face", icon='TRASH')
        if len(props.captures) > 1:
            column = layout.column(align=True)
            column.operator("wildcap.reconstruct_all", icon='MESH_MONKEY')
            column.operator("wildcap.solve_all", icon='LIGHT')
        layout.operator("wildcap.open_batch", icon='COMMUNITY')


class WILDCAP_PT_frames(CapturePanel, bpy.types.Panel):
    bl_label = "Frames"
    bl_order = 11

    def draw(self, context):
        layout = self.layout
        frame_strip = strip.of(captures.active(context))
        if frame_strip is None:
            layout.label(text="No frames yet: Reconstruct takes them from the video", icon='INFO')
            return
        counts = iface_("{} frames, {} in the texture").format(frame_strip.count, frame_strip.used)
        blurred = iface_(", {} blurred").format(frame_strip.blurred) if frame_strip.blurred else ""
        layout.label(text=counts + blurred, translate=False)
        grid = layout.grid_flow(row_major=True, columns=4, even_columns=True, align=True)
        for frame in frame_strip.frames:
            column = grid.column(align=True)
            column.template_icon(icon_value=frame.icon, scale=3.5)
            column.alert = frame.blurred
            column.label(text=f"{frame.sharpness:.0%}")
        layout.label(text="Sharpness, against the sharpest frame")


CLASSES = (WILDCAP_UL_captures, WILDCAP_PT_capture, WILDCAP_PT_frames)
