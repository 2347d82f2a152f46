# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: reconstruct the head up to the mask proposal, cancel, and bring the head into the scene."""

import bpy

from ...core import stages
from .. import captures, head, jobs
from ..base_operator import BaseOperator


class WILDCAP_OT_reconstruct(BaseOperator, bpy.types.Operator):
    """Turn the video into a textured head and propose its shadow mask; finished stages are not done twice"""

    bl_idname = "wildcap.reconstruct"
    bl_label = "Reconstruct"

    @classmethod
    def poll(cls, context):
        item = captures.active(context)
        return item is not None and jobs.of(captures.root(item)) is None

    def work(self, context):
        jobs.start(captures.require(context), "reconstruct", last=stages.MASK_STAGE)


class WILDCAP_OT_cancel(BaseOperator, bpy.types.Operator):
    """Stop the running job; what is finished is kept"""

    bl_idname = "wildcap.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        return jobs.of(captures.root(captures.active(context))) is not None or jobs.of("") is not None

    def work(self, context):
        root = captures.root(captures.active(context))
        jobs.cancel(root if jobs.of(root) else "")


class WILDCAP_OT_bring_in_head(BaseOperator, bpy.types.Operator):
    """Bring the reconstructed head into this scene, or update it in place"""

    bl_idname = "wildcap.bring_in_head"
    bl_label = "Bring In Head"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return context.mode == 'OBJECT'

    def work(self, context):
        item = captures.require(context)
        new = captures.head(context, item) is None
        obj = head.bring_in(context, item)
        if new:
            head.look_at(context, obj)


CLASSES = (WILDCAP_OT_reconstruct, WILDCAP_OT_cancel, WILDCAP_OT_bring_in_head)
