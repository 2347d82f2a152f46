# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Local View: a head that comes in is shown alone in it, and what joins it later would not be seen there."""

from collections.abc import Iterable

import bpy


def join(context, objects: Iterable[bpy.types.Object]) -> None:
    """Shows objects of the scene in every 3D view that is in Local View."""
    spaces = [
        area.spaces.active
        for window in context.window_manager.windows
        for area in window.screen.areas
        if area.type == 'VIEW_3D'
    ]
    context.view_layer.update()  # what was just linked is known to it only now
    for space in spaces:
        for thing in objects if space.local_view is not None else ():
            if thing.name in context.view_layer.objects:
                thing.local_view_set(space, True)
