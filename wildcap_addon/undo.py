# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo steps for results that a job writes into the scene.

Without one, the next Ctrl-Z, meant for the artist's last operation, would remove them too.
"""

import bpy


def push(label: str) -> None:
    """Push an undo step, except during a modal operation or in a mode with an undo of its own."""
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is not None and not window.modal_operators:
        with bpy.context.temp_override(window=window):
            if bpy.context.mode == 'OBJECT':
                bpy.ops.ed.undo_push(message=label)
