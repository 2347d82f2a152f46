# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the Relight panel: the material, and renders under one light, all lights, or once around."""

import bpy

from .. import captures, colours, hdri
from ..base_operator import BaseOperator, HeadOperator
from . import contact_sheet, headless, material, metering, output
from .picture import RenderSettings


class WILDCAP_OT_assemble_material(HeadOperator, bpy.types.Operator):
    """Put the solved maps into a skin material on the head; again in place, keeping the values you set"""

    bl_idname = "wildcap.assemble_material"
    bl_label = "Assemble Material"
    bl_options = {'REGISTER', 'UNDO'}

    unless_edited: bpy.props.BoolProperty(
        description="Leave a material alone that somebody changed", options={'HIDDEN', 'SKIP_SAVE'}
    )

    def work(self, context):
        item = captures.require(context)
        if self.unless_edited and material.is_edited(captures.require_head(context, item)):
            return
        skin, notice = material.assemble(context, item)
        if notice:
            self.report({'INFO'}, notice)
        self.warn(colours.missing(skin.node_tree.nodes[material.IMAGES[0][0]].image))


class Render(BaseOperator):
    """Mixin: renders the active head in Blender's render window, where Esc stops it."""

    @classmethod
    def poll(cls, context):
        return (
            cls.in_object_mode(context)
            and cls.with_capture(context)
            and cls.allowed(not output.busy(), "Blender is rendering: wait for it, or press Esc in its window")
        )

    def work(self, context):
        item = captures.require(context)
        self.warn(colours.missing_view(context.scene))
        self.render(captures.require_head(context, item), captures.folder(item).renders, context.scene.wildcap)

    def render(self, obj, folder, props):
        raise NotImplementedError


class WILDCAP_OT_render(Render, bpy.types.Operator):
    """Render the head with Cycles under the chosen light, to renders in the capture folder: a picture, and a linear EXR
    beside it"""

    bl_idname = "wildcap.render"
    bl_label = "Render"

    def render(self, obj, folder, props):
        headless.render_light(obj, folder, hdri.light(props), look(props), bpy.app.background)


class WILDCAP_OT_expose(Render, bpy.types.Operator):
    """Set Exposure so that this face is as bright in the mean as middle grey in the chosen light, and no more than half
    a percent of it is burnt out"""

    bl_idname = "wildcap.expose"
    bl_label = "Expose for This Face"
    bl_options = {'REGISTER', 'UNDO'}

    def render(self, obj, folder, props):
        props.exposure = metering.expose(obj, hdri.light(props), props.hdri_rotation)


class WILDCAP_OT_contact_sheet(Render, bpy.types.Operator):
    """Render the head in all of the lights, joined to one picture: renders/contact_sheet.png"""

    bl_idname = "wildcap.contact_sheet"
    bl_label = "Contact Sheet"

    def render(self, obj, folder, props):
        contact_sheet.render(obj, folder, bpy.app.background, look(props))


class WILDCAP_OT_turntable(Render, bpy.types.Operator):
    """Render the head or the light once around, to renders/turntable"""

    bl_idname = "wildcap.turntable"
    bl_label = "Turntable"

    def render(self, obj, folder, props):
        turn = headless.Turn(props.turns, props.turn_frames, props.turn_file == 'MP4')
        headless.turntable(obj, folder, hdri.light(props), turn, look(props), bpy.app.background)


def look(props) -> RenderSettings:
    """Return the scene's settings for a picture."""
    return RenderSettings(props.resolution, props.samples, props.hdri_rotation, props.view, props.exposure)


CLASSES = (
    WILDCAP_OT_assemble_material,
    WILDCAP_OT_render,
    WILDCAP_OT_expose,
    WILDCAP_OT_contact_sheet,
    WILDCAP_OT_turntable,
)
