# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: solve the maps from the texture and the mask, and enlarge them."""

import bpy

from ...core.messages import Problem
from .. import captures, jobs
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


CLASSES = (WILDCAP_OT_solve,)
