# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample head, copied to the artist's captures and shown; needs no solver."""

import bpy

from ...core.capture import sample_head
from ...core.capture.newest_maps import find_newest_maps
from .. import captures, preferences
from ..base_operator import BaseOperator


class WILDCAP_OT_open_sample_head(BaseOperator, bpy.types.Operator):
    """Copy the finished sample head to your captures and show it; needs no solver."""

    bl_idname = "wildcap.open_sample_head"
    bl_label = "Open Sample Head"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        capture = sample_head.copy_to(preferences.captures_folder())
        captures.add(context, capture.root)
        if context.mode != 'OBJECT':
            bpy.ops.object.mode_set(mode='OBJECT')
        bpy.ops.wildcap.bring_in_head()
        # an artist's copy may be without maps until its next solve
        if all(path.is_file() for path in find_newest_maps(capture)):
            bpy.ops.wildcap.assemble_material()


CLASSES = (WILDCAP_OT_open_sample_head,)
