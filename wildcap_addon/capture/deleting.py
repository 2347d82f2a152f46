# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that deletes a face from the disk, after listing what is deleted and what stays."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import deletion
from ...core.capture.messages import Problem
from .. import asking, batches, captures, jobs
from ..base_operator import Dialog


class WILDCAP_OT_delete_face(Dialog, bpy.types.Operator):
    """Delete everything that WildCap wrote for this face, including renders and exports.

    A dialog lists it first. Files that you added or changed stay.
    """

    bl_idname = "wildcap.delete_face"
    bl_label = "Delete Face"

    root: bpy.props.StringProperty(
        name="Capture",
        options={'HIDDEN', 'SKIP_SAVE'},
        description="Folder of the face that the dialog was opened for; empty: the active one",
    )

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
        removal = asking.find_answer(
            key,
            "looking at every file of the face",
            lambda task: deletion.plan(capture),
            "delete_face",
            lambda: captures.root(captures.active(bpy.context)) == str(capture.root),
        )
        if removal is None:
            return None
        asking.forget(key)  # the next dialog lists what is there then
        return (
            capture.root.name,
            *deletion.lines(removal, iface_),
            "A head in the scene stays as a mesh and loses its maps: deliver it first to keep them.",
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
        asking.run(
            "deleting the face", lambda task: deletion.delete(capture), lambda _: remove_from_lists(str(capture.root))
        )


def remove_from_lists(root: str) -> None:
    """Remove a capture from the lists of all scenes."""
    for scene in bpy.data.scenes:
        items = scene.wildcap.captures
        for index in reversed([i for i, item in enumerate(items) if captures.root(item) == root]):
            captures.remove(scene.wildcap, index, scene.wildcap.active_index)


CLASSES = (WILDCAP_OT_delete_face,)
