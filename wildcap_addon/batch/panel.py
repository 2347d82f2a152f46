# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of the open batch: progress of its faces and its run, and the walk through the masks."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.batch.state import DONE, STOPPED, TO_DO, WAITING, WORKING
from ...core.capture.messages import Problem
from .. import batches, captures, problems
from ..base_panel import WildcapPanel, region_width
from . import running


class WILDCAP_PT_batch(WildcapPanel, bpy.types.Panel):
    bl_label = "Batch"
    bl_order = 0  # above the brush: an artist goes from mask to mask
    bl_parent_id = "WILDCAP_PT_main"

    @classmethod
    def poll(cls, context):
        return batches.current() is not None

    def draw(self, context):
        layout, view, width = self.layout, batches.view(), region_width(context)
        row = layout.row(align=True)
        row.label(text=batches.current().name, translate=False, icon='COMMUNITY')
        row.operator("wildcap.open_batch", text="", icon='FILE_REFRESH').directory = str(batches.current())
        row.operator("wildcap.close_batch", text="", icon='X')
        problems.draw(layout, view.problem, width)
        if running.running():
            row = layout.row(align=True)
            words = iface_("Starting")
            if view.progress:
                words = iface_("{} of {} faces").format(view.progress["ended"], view.progress["of"])
            row.progress(text=words, translate=False, factor=batches.share(view))
            row.operator("wildcap.cancel_batch", text="", icon='CANCEL')
            if batches.line(view):
                problems.draw_text(layout, batches.line(view), width)
        if view.batch is None:
            return
        problems.draw_text(layout, count_words(view), width)
        if not batches.waiting() and batches.ready() and not running.running():
            layout.label(text="All masks reviewed", icon='CHECKMARK')
            layout.operator("wildcap.solve_all", icon='LIGHT')
        else:
            column = layout.column(align=True)
            column.operator("wildcap.accept_mask", icon='CHECKMARK')
            column.operator("wildcap.next_mask", icon='FORWARD')
        face = view.face(captures.root(captures.active(context)))
        face_state = view.states.get(face.name) if face else None
        if face_state is not None and face_state.state == STOPPED:
            problems.draw(layout, Problem(face_state.problem, face_state.remedy), width)


def count_words(view: batches.BatchView) -> str:
    """Describe the states of the faces: 'Masks waiting: 5, done: 3, to do: 4'."""
    waiting_count = len(batches.waiting())
    accepted_count = view.count(WAITING) - waiting_count  # since their last look
    counts = [
        (waiting_count, iface_("masks waiting: {}")),
        (view.count(DONE), iface_("done: {}")),
        (view.count(WORKING), iface_("in work: {}")),
        (view.count(STOPPED), iface_("stopped: {}")),
        (view.count(TO_DO) + accepted_count, iface_("to do: {}")),
        (len(view.batch.faces) - len(view.states), iface_("not looked at yet: {}")),
    ]
    text = ", ".join(words.format(count) for count, words in counts if count)
    return text[:1].upper() + text[1:]


CLASSES = (WILDCAP_PT_batch,)
