# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: solve the maps, whole or where the mask was edited, and estimate the skin tone."""

import bpy

from ...core.capture.messages import Problem
from .. import captures, jobs, status, tones, undo
from ..base_operator import BaseOperator, JobOperator
from . import live


class WILDCAP_OT_solve(JobOperator, bpy.types.Operator):
    """Remove light and shadow from the texture; after a cancel, continue from the last checkpoint."""

    bl_idname = "wildcap.solve"
    bl_label = "Solve"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        item = captures.require(context)
        capture = captures.folder(item)
        if not (capture.texture.is_file() and (capture.shadow_mask.is_file() or capture.shadow_mask_auto.is_file())):
            raise Problem("There is no texture to solve yet.", "Click Reconstruct first.")
        begin(context, item)


class WILDCAP_OT_solve_edited(BaseOperator, bpy.types.Operator):
    """Solve only the part of the maps that the last mask edit touched."""

    bl_idname = "wildcap.solve_edited"
    bl_label = "Solve the Edited Part"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if not jobs.can_start(cls, context):
            return False
        capture_status = status.of(captures.active(context))
        return cls.allowed(capture_status is not None, "Looking at the capture ...") and cls.allowed(
            not capture_status.whole_solve, f"{capture_status.whole_solve} Click Solve for the whole map"
        )

    def work(self, context):
        begin(context, captures.require(context), edited_part=True)


class WILDCAP_OT_estimate_skin_tone(JobOperator, bpy.types.Operator):
    """Estimate the skin tone and its uncertainty from the skin outside the shadow mask, in all frames.

    A measured white point improves it most.
    """

    bl_idname = "wildcap.estimate_skin_tone"
    bl_label = "Estimate"

    def work(self, context):
        root = captures.root(captures.require(context))

        def then() -> None:
            set_tone(root, job.figures)
            undo.push("Estimate Skin Tone")

        job = jobs.start_tool(captures.require(context), "skin_tone", then=then)


def begin(context, item, **once) -> None:
    """Start a capture's solve, or put it in line, and prepare its head for the preview. Raises Problem if it cannot."""
    jobs.start(item, "solve", first="solve", **once).on_preview = live.update
    live.prepare(context, item)


def set_tone(root: str, figures: dict) -> None:
    """Mark the estimated tone in the capture's settings, in all scenes; a tone that was chosen stays chosen."""
    for item in captures.of_root(root):
        if not item.use_skin_tone:
            item.skin_tone = figures["skin_tone_srgb"]
        item.estimated_tone, item.estimated_after = figures["skin_tone_srgb"], tones.solve_time(root)
        item.tone_group = figures.get("skin_tone_group", "")
        item.tone_source = figures.get("skin_tone_source", "")
        item.tone_deviation = figures.get("skin_tone_deviation_l", 0.0)


CLASSES = (WILDCAP_OT_solve, WILDCAP_OT_solve_edited, WILDCAP_OT_estimate_skin_tone)
