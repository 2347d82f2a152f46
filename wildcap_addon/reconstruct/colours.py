# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The film's middle under each choice of the setting Colour, to choose by looking."""

from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.settings.settings import find_setting
from .. import captures, jobs
from ..base_operator import JobOperator


def previews(capture: Capture) -> dict[str, Path]:
    """Return the pictures that exist, by choice."""
    choices = find_setting("frames.colour").metadata["choices"]
    paths = {choice: capture.preview / f"colour_{choice}.png" for choice in choices}
    return {choice: path for choice, path in paths.items() if path.is_file()}


class WILDCAP_OT_preview_colours(JobOperator, bpy.types.Operator):
    """Show the middle of the film under each choice: the one with natural skin, black and white is right."""

    bl_idname = "wildcap.preview_colours"
    bl_label = "Preview Colours"

    def work(self, context):
        item = captures.require(context)
        if not captures.folder(item).source:
            raise Problem("This capture has no video.", "Choose the video of your own face.")
        jobs.start_tool(item, "colours")


CLASSES = (WILDCAP_OT_preview_colours,)
