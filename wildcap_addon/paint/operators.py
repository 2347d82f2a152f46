# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: paint a mask on the head or on the flat sheet, edit it as a whole, save it and leave."""

import bpy

from ...core.capture import stages
from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures, jobs
from ..base_operator import BaseOperator, CaptureOperator
from . import edits, mask_image, session

EDITS = {
    "GROW": edits.grow,
    "SHRINK": edits.shrink,
    "SOFTEN": edits.soften,
    "MIRROR": edits.mirror,
    "INVERT": edits.invert,
    "CLEAR": edits.clear,
}


class WILDCAP_OT_paint_mask(CaptureOperator, bpy.types.Operator):
    """Paint shadows (red), or what must be kept as skin (green), on the head or on a flat sheet; Ctrl removes paint."""

    bl_idname = "wildcap.paint_mask"
    bl_label = "Paint Mask"
    bl_options = {'REGISTER', 'UNDO'}

    on: bpy.props.EnumProperty(
        name="On",
        items=[('HEAD', "Head", "Paint on the head"), ('SHEET', "Sheet", "Paint on the flat texture")],
        default='HEAD',
        options={'SKIP_SAVE'},
    )
    mask: bpy.props.EnumProperty(
        name="Mask",
        default='SHADOW',
        options={'SKIP_SAVE'},
        items=[
            ('SHADOW', "Shadow", "Where a shadow is baked into the texture"),
            ('PROTECT', "Protect", "Moles, scars and make-up that are not shadow; overrides the shadow mask"),
        ],
    )

    def work(self, context):
        session.begin_painting(context, captures.require(context), self.on == 'SHEET', self.mask)


class WILDCAP_OT_finish_mask(BaseOperator, bpy.types.Operator):
    """Save the mask or layer to the capture and return to Object Mode."""

    bl_idname = "wildcap.finish_mask"
    bl_label = "Save and Leave"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return cls.allowed(session.active(), "Nothing is being painted: begin under Masks, or under Retouch")

    def work(self, context):
        session.end_painting(context)


class WILDCAP_OT_edit_mask(BaseOperator, bpy.types.Operator):
    """Change the whole mask at once; Ctrl-Z undoes it like a stroke."""

    bl_idname = "wildcap.edit_mask"
    bl_label = "Edit Mask"
    bl_options = {'REGISTER'}  # `work` pushes a step of the image's own undo: the global one ignores pixels

    kind: bpy.props.EnumProperty(
        name="Change",
        options={'SKIP_SAVE'},
        items=[
            ('GROW', "Grow", "Wider by a few texels"),
            ('SHRINK', "Shrink", "Narrower by a few texels"),
            ('SOFTEN', "Soften", "Fade the borders"),
            ('MIRROR', "Mirror", "Mask on each side what is masked on the other"),
            ('INVERT', "Invert", "Shadow where there was none"),
            ('CLEAR', "Clear", "No shadow anywhere"),
            ('PROPOSAL', "Back to Proposal", "Start again from the proposed mask"),
            ('SNAPPED', "Use Snapped Mask", "Your mask, aligned with the shadow's edges"),
        ],
    )

    @classmethod
    def description(cls, context, properties):
        return cls.bl_rna.properties["kind"].enum_items[properties.kind].description + "; Ctrl-Z undoes it"

    @classmethod
    def poll(cls, context):
        return cls.allowed(
            session.active(), "Click Paint on the Head, under Masks, first: the mask is changed while it is painted"
        )

    def work(self, context):
        capture = Capture(session.root())
        if self.kind == 'SNAPPED' and session.offered() != 'SNAPPED':
            raise Problem("There is no snapped mask.", "Click Snap to Edges first, and wait until it is done.")
        if self.kind == 'PROPOSAL' and session.painted_kind() == 'PROTECT':
            raise Problem("There is no proposal for the protect mask.", "Paint it by hand, or click Clear.")
        image = session.mask()
        mask = mask_image.mask_values(image)
        files = {"PROPOSAL": capture.shadow_mask_auto, "SNAPPED": capture.shadow_mask_edges}
        new_mask = mask_image.proposal(image, files[self.kind]) if self.kind in files else EDITS[self.kind](mask)
        # the state that Ctrl-Z restores: Blender 5 stores the one before a step, not the one after it
        if not image.is_dirty or bpy.app.version >= (5, 0, 0):
            session.push_undo(context)
        mask_image.set_values(image, new_mask)
        session.push_undo(context)
        if self.kind == session.offered():
            session.offer("")


class ToolOperator(BaseOperator):
    """Operator that starts a worker during painting; its result waits for a click, so that no stroke is overwritten."""

    @classmethod
    def poll(cls, context):
        return cls.allowed(
            session.painted_kind() == 'SHADOW',
            "Click Paint on the Head, under Masks, and choose Shadow: only shadows can be detected",
        ) and jobs.can_start(cls, context)


class WILDCAP_OT_detect_mask(ToolOperator, bpy.types.Operator):
    """Detect the shadows in the texture again, with the sensitivity under Reconstruction.

    The result waits for a click; your painting stays.
    """

    bl_idname = "wildcap.detect_mask"
    bl_label = "Detect"

    def work(self, context):
        item = captures.require(context)
        stage = stages.by_name(stages.MASK_STAGE)
        missing = [name for name in stage.reads if not captures.folder(item).has(name)]
        if missing:
            raise Problem(
                f"Shadows are detected in {missing[0]}, which this capture does not have.",
                "Paint by hand: the sample head comes without it. Your own video has it after Reconstruct.",
            )
        jobs.start(item, "tool", first=stage.name, last=stage.name, then=lambda: session.offer('PROPOSAL'))


class WILDCAP_OT_snap_mask(ToolOperator, bpy.types.Operator):
    """Align the border of your mask with the shadow's edge in the texture, hard or soft.

    The result waits for a click.
    """

    bl_idname = "wildcap.snap_mask"
    bl_label = "Snap to Edges"

    def work(self, context):
        item = captures.require(context)
        jobs.start_tool(item, "mask_edges", then=lambda: session.offer('SNAPPED'))


CLASSES = (
    WILDCAP_OT_paint_mask,
    WILDCAP_OT_finish_mask,
    WILDCAP_OT_edit_mask,
    WILDCAP_OT_detect_mask,
    WILDCAP_OT_snap_mask,
)
