# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that measure the white point: from a ColorChecker in the frames, a grey card or white paper."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture.messages import Problem
from ...core.settings.settings import CARDS
from .. import captures, colours, jobs, undo
from ..base_operator import CaptureOperator, JobOperator
from .eyedropper import colour_at

BURNT_SRGB, BLACK_SRGB = 0.97, 0.04
"""sRGB values beyond which a channel is clipped."""


class WILDCAP_OT_find_color_checker(JobOperator, bpy.types.Operator):
    """Find a ColorChecker in the frames, and measure the white point on its greys instead of estimating it."""

    bl_idname = "wildcap.find_color_checker"
    bl_label = "Find ColorChecker"

    def work(self, context):
        root = captures.root(captures.require(context))

        def then() -> None:
            set_white(root, job.figures["white_point"])
            undo.push("Find ColorChecker")

        job = jobs.start_tool(captures.require(context), "white_point", then=then)


class WILDCAP_OT_pick_white_point(CaptureOperator, bpy.types.Operator):
    """Show a frame: click on a grey card or white paper that is in the face's light.

    Mouse wheel or arrow keys show other frames, Esc cancels.
    """

    bl_idname = "wildcap.pick_white_point"
    bl_label = "Pick White Point"
    bl_options = {'REGISTER', 'UNDO'}

    card: bpy.props.EnumProperty(
        name="Card", items=[('grey', "Grey Card", "Of 18 percent"), ('white', "White Paper", "Plain paper, not glossy")]
    )
    frame: bpy.props.StringProperty(name="Frame", description="Name of the frame's file")
    uv: bpy.props.FloatVectorProperty(name="UV", size=2, description="Place on the frame, set by a click")

    def invoke(self, context, event):
        self._frames = sorted(path.name for path in captures.folder(captures.require(context)).frames.glob("*.jpg"))
        if not self._frames or context.area is None or context.area.type != 'VIEW_3D':
            return self.execute(context)
        self._at, self._area, self._shown = len(self._frames) // 2, context.area, None
        self._area.type = 'IMAGE_EDITOR'
        self._show(context)
        context.window.cursor_modal_set('EYEDROPPER')
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context, event):
        step = {'WHEELUPMOUSE': -1, 'LEFT_ARROW': -1, 'WHEELDOWNMOUSE': 1, 'RIGHT_ARROW': 1}.get(event.type)
        if step is not None and event.value == 'PRESS':
            self._at = (self._at + step) % len(self._frames)
            self._show(context)
        if event.type in ('ESC', 'RIGHTMOUSE'):
            self._leave(context)
            return {'CANCELLED'}
        if event.type != 'LEFTMOUSE' or event.value != 'PRESS':
            return {'RUNNING_MODAL'}
        region = next(r for r in self._area.regions if r.type == 'WINDOW')
        u, v = region.view2d.region_to_view(event.mouse_x - region.x, event.mouse_y - region.y)
        self._leave(context)
        self.frame, self.uv = self._frames[self._at], (u, v)
        return self.execute(context)

    def work(self, context):
        item = captures.require(context)
        path = captures.folder(item).frames / self.frame
        if not self.frame or not path.is_file():
            raise Problem(
                "There is no such frame in this capture.", "Click Reconstruct first: the frames come with it."
            )
        if not all(0 <= c < 1 for c in self.uv):
            raise Problem("That click was outside the frame: nothing was measured.", "Click on the card.")
        image = bpy.data.images.load(str(path))
        try:
            colour = np.array(colour_at(image, self.uv))
        finally:
            bpy.data.images.remove(image)
        if colour.max() > BURNT_SRGB or colour.min() < BLACK_SRGB:
            raise Problem(
                "The card is overexposed or black there.",
                "Choose another frame or place, or a grey card instead of white paper.",
            )
        set_white(captures.root(item), (colours.srgb_to_linear(colour) / CARDS[self.card]).tolist())

    def _show(self, context):
        """Show the current frame in the editor."""
        frame = captures.folder(captures.require(context)).frames / self._frames[self._at]
        before, self._shown = self._shown, bpy.data.images.load(str(frame))
        self._area.spaces.active.image = self._shown
        if before is not None:
            bpy.data.images.remove(before)
        text = iface_("Frame {}: click on the card, wheel or arrows for other frames, Esc to leave")
        self._area.header_text_set(text.format(self._frames[self._at]))

    def _leave(self, context):
        context.window.cursor_modal_restore()
        self._area.header_text_set(None)
        self._area.type = 'VIEW_3D'
        bpy.data.images.remove(self._shown)


class WILDCAP_OT_clear_white_point(CaptureOperator, bpy.types.Operator):
    """Forget the measured white point: it is estimated from the scene again."""

    bl_idname = "wildcap.clear_white_point"
    bl_label = "Clear White Point"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        captures.require(context).solve.white_point = "auto"


def set_white(root: str, linear: list[float]) -> None:
    """Store the measured white point in the capture's settings, in all scenes."""
    for item in captures.of_root(root):
        item.solve.white_point = ",".join(f"{v:.4f}" for v in linear)


CLASSES = (WILDCAP_OT_find_color_checker, WILDCAP_OT_pick_white_point, WILDCAP_OT_clear_white_point)
