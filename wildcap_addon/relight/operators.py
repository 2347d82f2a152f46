# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: the maps into a material, and a picture under a light."""

import bpy

from .. import captures, colours, hdri
from ..base_operator import BaseOperator
from . import headless, material


class WILDCAP_OT_assemble_material(BaseOperator, bpy.types.Operator):
    """Put the solved maps into a skin material on the head; again in place, keeping the values you set"""

    bl_idname = "wildcap.assemble_material"
    bl_label = "Assemble Material"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return cls.in_object_mode(context) and cls.with_capture(context)

    def work(self, context):
        skin = material.assemble(context, captures.require(context))
        self.warn(colours.missing(skin.node_tree.nodes[material.IMAGES[0][0]].image))


class WILDCAP_OT_render(BaseOperator, bpy.types.Operator):
    """Render the head with Cycles under the chosen light, to renders in the capture folder"""

    bl_idname = "wildcap.render"
    bl_label = "Render"

    @classmethod
    def poll(cls, context):
        return cls.in_object_mode(context) and cls.with_capture(context)

    def work(self, context):
        item = captures.require(context)
        props = context.scene.wildcap
        self.warn(colours.missing_view(context.scene))
        headless.render_light(captures.require_head(context, item), captures.folder(item).renders, hdri.light(props), props.resolution, props.samples,
                              props.hdri_rotation, wait=bpy.app.background)


CLASSES = (WILDCAP_OT_assemble_material, WILDCAP_OT_render)
