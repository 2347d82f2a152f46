# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: solve the maps from the texture and the mask, whole or where the mask was edited, and enlarge them."""

import bpy

from ...core.capture.messages import Problem
from .. import captures, jobs, status, undo
from ..base_operator import BaseOperator, JobOperator
from . import live, preview


class WILDCAP_OT_solve(JobOperator, bpy.types.Operator):
    """Take light and shadow out of the texture; continues from the last checkpoint after a cancel"""

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
    """Solve only the part of the maps that the last mask edit touched; everything else of them stays as it is"""

    bl_idname = "wildcap.solve_edited"
    bl_label = "Solve the Edited Part"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if not jobs.can_start(cls, context):
            return False
        known = status.of(captures.active(context))
        return cls.allowed(known is not None, "Looking at the capture ...") and cls.allowed(
            not known.whole_solve, f"{known.whole_solve} Click Solve for the whole map"
        )

    def work(self, context):
        begin(context, captures.require(context), edited_part=True)


class WILDCAP_OT_estimate_skin_tone(JobOperator, bpy.types.Operator):
    """Look at the skin outside of the shadow mask in all frames, and set the skin tone from it, with how sure it is; a
    measured white point helps most"""

    bl_idname = "wildcap.estimate_skin_tone"
    bl_label = "Estimate"

    def work(self, context):
        root = captures.root(captures.require(context))

        def then() -> None:
            set_tone(root, job.figures)
            undo.push("Estimate Skin Tone")

        job = jobs.start_tool(captures.require(context), "skin_tone", then=then)


def begin(context, item, **shared) -> None:
    """Starts a capture's solve, or puts it in line, and makes its head ready to show how far it is. Raises Problem when
    it cannot."""
    jobs.start(item, "solve", first="solve", **shared).on_preview = live.update
    preview.forget()
    live.prepare(context, item)


def set_tone(root: str, figures: dict) -> None:
    """The estimated tone into the settings of the capture, in whichever scene lists it."""
    for item in captures.listed():
        if captures.root(item) == root:
            item.skin_tone, item.use_skin_tone = figures["skin_tone_srgb"], True
            item.estimated_tone = figures["skin_tone_srgb"]
            item.tone_group = figures.get("skin_tone_group", "")
            item.tone_source = figures.get("skin_tone_source", "")
            item.tone_deviation = figures.get("skin_tone_deviation_l", 0.0)


CLASSES = (WILDCAP_OT_solve, WILDCAP_OT_solve_edited, WILDCAP_OT_estimate_skin_tone)
