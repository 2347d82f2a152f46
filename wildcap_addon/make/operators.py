# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: from the video, or from the proposed mask, to a relit head."""

import bpy

from ...core.capture.messages import Problem
from .. import captures
from ..base_operator import JobOperator
from . import results


class WILDCAP_OT_make_my_head(JobOperator, bpy.types.Operator):
    """Make a relit head from the video or the photographs.

    Reconstructs, solves with the proposed shadow mask, puts the maps on the head, and renders it.
    """

    bl_idname = "wildcap.make_my_head"
    bl_label = "Make My Head"

    def work(self, context):
        item = captures.require(context)
        capture = captures.folder(item)
        if not capture.source and not capture.texture.is_file():
            raise Problem("This capture has no video to make a head from.", "Choose the video of your own face.")
        results.begin(item)


class WILDCAP_OT_accept_proposal(JobOperator, bpy.types.Operator):
    """Solve with the proposed shadow mask, or as it was painted, and go on to a relit head.

    You can still paint it and solve again.
    """

    bl_idname = "wildcap.accept_proposal"
    bl_label = "Accept Proposal"

    def work(self, context):
        item = captures.require(context)
        capture = captures.folder(item)
        if not (capture.texture.is_file() and (capture.shadow_mask.is_file() or capture.shadow_mask_auto.is_file())):
            raise Problem("There is no proposed mask yet.", "Click Make My Head, or Reconstruct, first.")
        results.begin(item, first="solve")


CLASSES = (WILDCAP_OT_make_my_head, WILDCAP_OT_accept_proposal)
