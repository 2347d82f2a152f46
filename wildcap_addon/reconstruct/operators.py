# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: reconstruct the head up to the mask proposal, cancel, and bring results into the scene."""

import bpy

from ...core.capture import stages
from ...core.capture.messages import Problem
from .. import captures, head, jobs
from ..base_operator import BaseOperator, HeadOperator, JobOperator
from . import evidence, landmarks


class WILDCAP_OT_reconstruct(JobOperator, bpy.types.Operator):
    """Turn the video into a textured head and propose its shadow mask; finished stages are not repeated."""

    bl_idname = "wildcap.reconstruct"
    bl_label = "Reconstruct"

    first: bpy.props.StringProperty(
        name="From",
        options={'SKIP_SAVE'},
        description="Stage to begin with, even if it is fresh; empty: the first that is not done",
    )

    to_end: bpy.props.BoolProperty(
        name="To the End", options={'SKIP_SAVE'}, description="Go on past the mask, to the end of the chain"
    )

    @classmethod
    def description(cls, context, properties):
        if properties.to_end:
            return "Fit your own mesh and texture the scan; earlier stages run only if they are out of date"
        if properties.first not in stages.NAMES:
            return cls.bl_description
        end = "to the end" if _is_after_mask(properties.first) else "up to the mask"
        return f"Run from the stage {stages.by_name(properties.first).label} {end}, even if it is done"

    def work(self, context):
        item = captures.require(context)
        after_mask = self.to_end or self.first and _is_after_mask(self.first)
        if not after_mask and not captures.folder(item).source:
            raise Problem(
                "This capture has no video: there is nothing to reconstruct it from.",
                "Choose the video of your own face.",
            )
        jobs.start(
            item,
            "solve" if after_mask else "reconstruct",
            first=self.first or None,
            last=None if after_mask else stages.MASK_STAGE,
        )


def _is_after_mask(stage: str) -> bool:
    """Return whether a stage comes after the mask. Raises Problem for an unknown one."""
    return stages.NAMES.index(stages.by_name(stage).name) > stages.NAMES.index(stages.MASK_STAGE)


class WILDCAP_OT_cancel(BaseOperator, bpy.types.Operator):
    """Stop the running job; finished stages are kept."""

    bl_idname = "wildcap.cancel"
    bl_label = "Cancel"

    capture: bpy.props.StringProperty(
        name="Capture",
        description="Folder of the capture whose job is cancelled; empty: the active one",
        options={'SKIP_SAVE'},
    )

    @classmethod
    def poll(cls, context):
        root = captures.root(captures.active(context))
        running = jobs.of(root) is not None or jobs.of("") is not None or jobs.elsewhere(root)
        return cls.allowed(running, "Nothing is running")

    def work(self, context):
        root = self.capture or captures.root(captures.active(context))
        jobs.cancel(root if jobs.of(root) else "")


class WILDCAP_OT_bring_in_head(HeadOperator, bpy.types.Operator):
    """Bring the reconstructed head into this scene, or update it in place."""

    bl_idname = "wildcap.bring_in_head"
    bl_label = "Bring In Head"

    def work(self, context):
        item = captures.require(context)
        new = captures.head(context, item) is None
        obj = head.bring_in(context, item)
        if new:
            head.look_at(context, obj)


class WILDCAP_OT_bring_in_cameras(HeadOperator, bpy.types.Operator):
    """Bring in the cameras of the frames, each with its frame behind the head, or update them in place."""

    bl_idname = "wildcap.bring_in_cameras"
    bl_label = "Bring In Cameras"

    every: bpy.props.BoolProperty(
        name="Every Frame", default=False, description="All registered frames; off: those that the texture is made from"
    )

    def work(self, context):
        evidence.bring_in_cameras(context, captures.require(context), self.every)


class WILDCAP_OT_bring_in_scan(HeadOperator, bpy.types.Operator):
    """Bring in the scan that the head was fitted to, or update it in place."""

    bl_idname = "wildcap.bring_in_scan"
    bl_label = "Bring In Scan"

    def work(self, context):
        evidence.bring_in_scan(context, captures.require(context))


class WILDCAP_OT_show_landmarks(HeadOperator, bpy.types.Operator):
    """Show the head's landmarks as small spheres: move those that are wrong, then click Fit Head Again."""

    bl_idname = "wildcap.show_landmarks"
    bl_label = "Show Landmarks"

    def work(self, context):
        landmarks.show(context, captures.require(context))


def _with_landmarks(operator, context) -> bool:
    return operator.in_object_mode(context) and operator.allowed(
        landmarks.shown_landmarks(captures.active(context)), "No landmarks are shown: click Show Landmarks first"
    )


class WILDCAP_OT_hide_landmarks(BaseOperator, bpy.types.Operator):
    """Hide the landmarks without fitting the head again; corrections stored earlier are kept."""

    bl_idname = "wildcap.hide_landmarks"
    bl_label = "Hide Landmarks"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return _with_landmarks(cls, context)

    def work(self, context):
        landmarks.hide(captures.require(context))


class WILDCAP_OT_fit_landmarks(BaseOperator, bpy.types.Operator):
    """Store the landmarks that were moved, and fit the head again; they override those of the frames."""

    bl_idname = "wildcap.fit_landmarks"
    bl_label = "Fit Head Again"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return _with_landmarks(cls, context) and jobs.can_start(cls, context)

    def work(self, context):
        item = captures.require(context)
        if not landmarks.keep_moved(item):
            raise Problem(
                "No landmark was moved.", "Move a sphere to where it belongs on the face, then click Fit Head Again."
            )
        jobs.start(item, "reconstruct", first="registration", last=stages.MASK_STAGE)
        landmarks.hide(item)


CLASSES = (
    WILDCAP_OT_reconstruct,
    WILDCAP_OT_cancel,
    WILDCAP_OT_bring_in_head,
    WILDCAP_OT_bring_in_cameras,
    WILDCAP_OT_bring_in_scan,
    WILDCAP_OT_show_landmarks,
    WILDCAP_OT_hide_landmarks,
    WILDCAP_OT_fit_landmarks,
)
