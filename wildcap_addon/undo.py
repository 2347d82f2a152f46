# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A step of Blender's undo for what a job wrote into the scene when it ended: without one the next Ctrl-Z, meant for
what the artist did last, takes that along."""

import bpy


def push(label: str) -> None:
    """Not in the middle of a move, nor in a mode that has an undo of its own."""
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is not None and not window.modal_operators:
        with bpy.context.temp_override(window=window):
            if bpy.context.mode == 'OBJECT':
                bpy.ops.ed.undo_push(message=label)
