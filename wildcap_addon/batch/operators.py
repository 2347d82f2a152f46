# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: reconstruct or solve all faces by a batch, open one planned elsewhere, and walk through its masks."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...core.batch.gate import is_accepted
from ...core.batch.record import GATES, Batch, read_batch
from ...core.batch.state import WAITING
from ...core.capture.messages import Problem
from .. import batches, captures, jobs, preferences
from ..base_operator import BaseOperator, FileOperator
from . import planning, running, walking


def _with_batch(operator) -> bool:
    return operator.allowed(batches.current() is not None, "No batch is open: click Open Batch first")


def _without_run(operator) -> bool:
    return operator.allowed(not running.running(), "A batch is running: wait for it, or cancel it")


class AllFaces(BaseOperator):
    """Operator that starts a batch."""

    @classmethod
    def poll(cls, context):
        many = batches.current() is not None or len(context.scene.wildcap.captures) > 1
        return (
            cls.allowed(many, "The list has fewer than two captures: use that capture's own buttons")
            and _without_run(cls)
            and cls.allowed(not jobs.elsewhere(""), "A job is running: wait for it, or click Cancel")
        )

    def prepare(self, context) -> Batch:
        """Return the batch of all faces, with the painted mask saved. Raises Problem, if possible before writing."""
        preferences.require_python()
        for save in jobs.before_start:
            save()
        batch, left_out = planning.prepare(context)
        if left_out:
            self.report({'WARNING'}, rpt_("Left out for lack of a video: {}").format(", ".join(left_out)))
        return batch


class WILDCAP_OT_reconstruct_all(AllFaces, bpy.types.Operator):
    """Reconstruct every face of the list, or of the open batch, up to its shadow mask.

    This goes on if you close Blender.
    """

    bl_idname = "wildcap.reconstruct_all"
    bl_label = "Reconstruct All"

    def work(self, context):
        batch = self.prepare(context)
        running.start(batch, "retry", "--until", "mask", str(batch.root))


class WILDCAP_OT_solve_all(AllFaces, bpy.types.Operator):
    """Solve every face that has a shadow mask, painted or proposed.

    This goes on if you close Blender.
    """

    bl_idname = "wildcap.solve_all"
    bl_label = "Solve All"

    def work(self, context):
        batch = self.prepare(context)
        faces = [face for face in batch.faces if face.capture.shadow_mask_auto.is_file()]
        if not faces:
            raise Problem("There is nothing to solve: no face has a shadow mask yet.", "Click Reconstruct All first.")
        for face in faces if batch.gate == GATES[1] else ():
            if not is_accepted(face.capture):
                batches.accept(face)
        names = [face.name for face in faces] if len(faces) < len(batch.faces) else []
        running.start(batch, "retry", str(batch.root), *names)


class WILDCAP_OT_cancel_batch(BaseOperator, bpy.types.Operator):
    """Stop the batch; finished stages are kept, and the same button continues from there."""

    bl_idname = "wildcap.cancel_batch"
    bl_label = "Cancel Batch"

    @classmethod
    def poll(cls, context):
        return cls.allowed(running.running(), "No batch is running")

    def work(self, context):
        running.cancel()


class WILDCAP_OT_open_batch(FileOperator, bpy.types.Operator):
    """Open the folder of a batch, also of one from a terminal or a farm, and add its faces to the list."""

    bl_idname = "wildcap.open_batch"
    bl_label = "Open Batch"
    bl_options = {'REGISTER', 'UNDO'}

    directory: bpy.props.StringProperty(subtype='DIR_PATH', options={'SKIP_SAVE'})

    def invoke(self, context, event):
        if self.directory:
            return self.execute(context)
        return super().invoke(context, event)

    def work(self, context):
        batch = read_batch(Path(bpy.path.abspath(self.directory)))
        if running.started_here() and batch.root != batches.current():
            raise Problem("A batch is running.", "Wait for it, or cancel it, before you open another one.")
        before = captures.root(captures.active(context))
        for face in batch.faces:
            if face.root.is_dir():
                walking.list_face(context, face)
        if before in {str(face.root) for face in batch.faces}:
            captures.add(context, Path(before))
        batches.choose(batch.root)


class WILDCAP_OT_close_batch(BaseOperator, bpy.types.Operator):
    """Remove the batch from this tab; its folder and its captures stay."""

    bl_idname = "wildcap.close_batch"
    bl_label = "Close Batch"

    @classmethod
    def poll(cls, context):
        return _with_batch(cls) and _without_run(cls)

    def work(self, context):
        batches.close()


class MaskWalk(BaseOperator):
    """Operator of the walk through the masks."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return _with_batch(cls) and cls.allowed(
            context.mode == 'OBJECT' or walking.painting(), "This works in Object Mode only, or while you paint a mask"
        )


class WILDCAP_OT_next_mask(MaskWalk, bpy.types.Operator):
    """Bring in the next face whose shadow mask waits for approval, and paint it.

    The mask that is being painted is saved, but not accepted.
    """

    bl_idname = "wildcap.next_mask"
    bl_label = "Next Mask"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and cls.allowed(
            cls.face(context) is not None, "No other mask waits to be looked at"
        )

    @staticmethod
    def face(context):
        root = captures.root(captures.active(context))
        return walking.following("" if not walking.painting() and len(batches.waiting()) == 1 else root)

    def work(self, context):
        walking.go(context, self.face(context))


class WILDCAP_OT_accept_mask(MaskWalk, bpy.types.Operator):
    """Accept this face's shadow mask as it is, painted or proposed, and bring in the next face that waits."""

    bl_idname = "wildcap.accept_mask"
    bl_label = "Accept and Next"

    @classmethod
    def poll(cls, context):
        face_state = batches.state_of(captures.root(captures.active(context)))
        return super().poll(context) and cls.allowed(
            face_state is not None and face_state.state == WAITING, "This face's mask does not wait: click Next Mask"
        )

    def work(self, context):
        root = captures.root(captures.require(context))
        walking.leave(root)
        batches.accept(batches.view().face(root))
        next_face = walking.following(root)
        if next_face is not None:
            walking.go(context, next_face)
        else:
            self.report({'INFO'}, rpt_("All masks reviewed: click Solve All"))


CLASSES = (
    WILDCAP_OT_reconstruct_all,
    WILDCAP_OT_solve_all,
    WILDCAP_OT_cancel_batch,
    WILDCAP_OT_open_batch,
    WILDCAP_OT_close_batch,
    WILDCAP_OT_next_mask,
    WILDCAP_OT_accept_mask,
)
