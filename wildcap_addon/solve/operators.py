# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: solve the maps from the texture and the mask, whole or where the mask was edited, and enlarge them."""

import bpy

from ...core.messages import Problem
from .. import captures, jobs, status
from ..base_operator import BaseOperator
from . import preview


class WILDCAP_OT_solve(BaseOperator, bpy.types.Operator):
    """Take light and shadow out of the texture; continues from the last checkpoint after a cancel"""

    bl_idname = "wildcap.solve"
    bl_label = "Solve"

    @classmethod
    def poll(cls, context):
        return jobs.can_start(cls, context)

    def work(self, context):
        item = captures.require(context)
        capture = captures.folder(item)
        if not (capture.texture.is_file() and (capture.shadow_mask.is_file() or capture.shadow_mask_auto.is_file())):
            raise Problem("There is no texture to solve yet.", "Click Reconstruct first.")
        jobs.start(item, "solve", first="solve")
        preview.forget()


class WILDCAP_OT_solve_edited(BaseOperator, bpy.types.Operator):
    """Solve only the part of the maps that the last mask edit touched; everything else of them stays as it is"""

    bl_idname = "wildcap.solve_edited"
    bl_label = "Solve the Edited Part"

    @classmethod
    def poll(cls, context):
        if not jobs.can_start(cls, context):
            return False
        known = status.of(captures.active(context))
        if known is None or known.whole_solve:
            cls.poll_message_set("Looking at the capture ..." if known is None else f"{known.whole_solve} Click Solve for the whole map")
            return False
        return True

    def work(self, context):
        jobs.start(captures.require(context), "solve", first="solve", edited_part=True)
        preview.forget()


CLASSES = (WILDCAP_OT_solve, WILDCAP_OT_solve_edited)
