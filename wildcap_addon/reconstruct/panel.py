# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the stages up to the mask proposal, their choices and settings."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import stages
from .. import captures, frame_icons, problems
from ..base_panel import CapturePanel, draw_settings, region_width
from . import card, colours, delighters, landmarks


class WILDCAP_PT_reconstruct(CapturePanel, bpy.types.Panel):
    bl_label = "Reconstruction"
    bl_order = 20

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        item = captures.active(context)
        layout.prop(item, "quality")
        layout.operator("wildcap.reconstruct")
        row = layout.row(align=True)
        for name, icon in (("head", 'MESH_MONKEY'), ("cameras", 'CAMERA_DATA'), ("scan", 'OUTLINER_DATA_POINTCLOUD')):
            row.operator(f"wildcap.bring_in_{name}", text=name.title(), icon=icon)
        row = layout.row(align=True)
        action = "hide" if landmarks.shown_landmarks(item) else "show"
        row.operator(f"wildcap.{action}_landmarks", icon='EMPTY_AXIS')
        row.operator("wildcap.fit_landmarks")
        for stage in stages.STAGES[: stages.NAMES.index(stages.MASK_STAGE) + 1]:
            if stage.name != "delight":  # the Delighter panel has its settings
                draw_settings(layout, item, stage, without=("template", "new_atlas", "colour"))


class WILDCAP_PT_colour(CapturePanel, bpy.types.Panel):
    bl_label = "Colour"
    bl_parent_id = "WILDCAP_PT_reconstruct"

    def draw(self, context):
        layout = self.layout
        item = captures.active(context)
        layout.prop(item.frames, "colour", text="")
        layout.operator("wildcap.preview_colours", icon='IMAGE_DATA')
        previews = colours.previews(captures.folder(item))
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True)
        for choice, path in previews.items():
            column = grid.column(align=True)
            column.template_icon(icon_value=frame_icons.load(path), scale=5)
            column.prop_enum(item.frames, "colour", choice)


class WILDCAP_PT_head_mesh(CapturePanel, bpy.types.Panel):
    bl_label = "Head Mesh"
    bl_parent_id = "WILDCAP_PT_reconstruct"

    def draw(self, context):
        layout = self.layout
        item = captures.active(context)
        own = item.registration.template
        width = region_width(context)
        beside = iface_("The built-in head, and {} beside it.").format(bpy.path.basename(own.rstrip('/')))
        problems.draw_text(layout, beside if own else "The built-in head.", width)
        column = layout.column(align=True)
        column.operator("wildcap.use_active_mesh", icon='OUTLINER_OB_MESH')
        column.operator("wildcap.choose_template", text="Choose OBJ or ICT-FaceKit Folder", icon='FILE_FOLDER')
        column.operator("wildcap.use_built_in_head", icon='X')
        if own:
            layout.prop(item.registration, "new_atlas")


class WILDCAP_PT_delighter(CapturePanel, bpy.types.Panel):
    bl_label = "Delighter"
    bl_parent_id = "WILDCAP_PT_reconstruct"

    def draw(self, context):
        layout = self.layout
        item = captures.active(context)
        width = region_width(context)
        card.draw(layout, item, width)
        capture = captures.folder(item)
        layout.operator("wildcap.compare_delit", icon='IMAGE_DATA')
        name = delighters.shown_frame(capture)
        if name:
            layout.template_icon(icon_value=delighters.icon(), scale=11)
            text = iface_("Frame {}").format(name)
            layout.prop(context.window_manager, "wildcap_wipe", text=text, translate=False, slider=True)


CLASSES = (WILDCAP_PT_reconstruct, WILDCAP_PT_colour, WILDCAP_PT_head_mesh, WILDCAP_PT_delighter)
