# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: delete a face from the disk, after a list of all that goes and all that stays."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import deletion
from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.worker.background import BackgroundTask
from .. import asking, batches, captures, jobs
from ..base_operator import Dialog


class WILDCAP_OT_delete_face(Dialog, bpy.types.Operator):
    """Delete all that WildCap wrote of this face, renders and exports among it: first you are told what goes. Files
    that you added or changed stay"""

    bl_idname = "wildcap.delete_face"
    bl_label = "Delete Face"

    @classmethod
    def poll(cls, context):
        return (
            cls.in_object_mode(context)
            and jobs.can_start(cls, context)
            and cls.allowed(
                jobs.of("") is None,
                "The solver is being set up, or another face is looked at: wait for it, or click Cancel",
            )
            and cls.allowed(
                not (batches.view().runner and batches.view().face(captures.root(captures.active(context)))),
                "This face is one of a batch that is running, which would make it again: wait for it, or cancel it",
            )
        )

    @staticmethod
    def tell() -> tuple[str, ...] | None:
        capture = captures.folder(captures.require(bpy.context))
        key = ("deletion", str(capture.root))
        removal = asking.answer(key)
        asking.forget(key)  # whoever closes the dialog and comes back is told what is there then
        if removal is None:
            asking.find_answer(
                key,
                lambda task: look_at(task, capture),
                "delete_face",
                lambda: captures.root(captures.active(bpy.context)) == str(capture.root),
            )
            return None
        return (
            capture.root.name,
            *deletion.lines(removal, iface_),
            "A head in the scene stays as a mesh and loses its maps: deliver it first to keep them.",
        )

    root: bpy.props.StringProperty(
        name="Capture",
        options={'HIDDEN', 'SKIP_SAVE'},
        description="Folder of the face that was asked for; empty: the active one",
    )

    def invoke(self, context, event):
        self.root = captures.root(captures.active(context))
        return super().invoke(context, event)

    def work(self, context):
        capture = captures.folder(captures.require(context))
        if self.root not in ("", str(capture.root)):
            raise Problem(
                "Another face is selected now, not the one that you wanted to delete.",
                "Select that one, and click Delete Face again.",
            )
        jobs.start_worker(
            "", "ask", BackgroundTask("setup", lambda task: delete(task, capture)), lambda: forget(str(capture.root))
        )


def look_at(task: BackgroundTask, capture: Capture) -> deletion.Deletion:
    task.say(0, 1, "looking at every file of the face")
    return deletion.plan(capture)


def delete(task: BackgroundTask, capture: Capture) -> deletion.Deletion:
    task.say(0, 1, "deleting the face")
    return deletion.delete(capture)


def forget(root: str) -> None:
    """Takes the capture off the lists of all scenes."""
    for scene in bpy.data.scenes:
        props = scene.wildcap
        for index in reversed([i for i, item in enumerate(props.captures) if captures.root(item) == root]):
            props.captures.remove(index)
            props.active_index = max(0, min(props.active_index, len(props.captures) - 1))


CLASSES = (WILDCAP_OT_delete_face,)
