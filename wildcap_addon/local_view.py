# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Local View: it shows a head alone when it comes in, and would hide what is added later."""

from collections.abc import Iterable

import bpy


def join(context, objects: Iterable[bpy.types.Object]) -> None:
    """Show objects of the scene in every 3D view that is in Local View."""
    context.view_layer.update()  # it does not yet know objects that were just linked
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    for space in (area.spaces.active for area in areas if area.type == 'VIEW_3D'):
        for thing in objects if space.local_view is not None else ():
            if thing.name in context.view_layer.objects:
                thing.local_view_set(space, True)
