# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""3D views during painting: flat texture under the tinted mask; and their state before."""

import bpy

SHADING = {"type": 'SOLID', "light": 'FLAT', "color_type": 'TEXTURE'}


def remember(screen: bpy.types.Screen) -> list[dict]:
    """Return the state of the screen's 3D views, names and values only."""
    return [
        {
            "screen": screen.name,
            "area": index,
            "shading": {name: getattr(area.spaces.active.shading, name) for name in SHADING},
            "overlays": area.spaces.active.overlay.show_overlays,
            "opacity": area.spaces.active.overlay.texture_paint_mode_opacity,
            "perspective": area.spaces.active.region_3d.view_perspective,
            "rotation": tuple(area.spaces.active.region_3d.view_rotation),
            "location": tuple(area.spaces.active.region_3d.view_location),
            "distance": area.spaces.active.region_3d.view_distance,
        }
        for index, area in enumerate(screen.areas)
        if area.type == 'VIEW_3D'
    ]


def set_up(before: list[dict], opacity: float) -> None:
    """Show the texture flat, in Solid shading, and the tint over it with that opacity."""
    for space, _ in _spaces(before):
        for name, value in SHADING.items():  # the type first: the other values depend on it
            setattr(space.shading, name, value)
        space.overlay.show_overlays = True
        space.overlay.texture_paint_mode_opacity = opacity


def opacity(before: list[dict]) -> float | None:
    """Return the tint's current opacity in the first of these views."""
    return next((space.overlay.texture_paint_mode_opacity for space, _ in _spaces(before)), None)


def restore(before: list[dict]) -> None:
    """Restore shading and overlays of the views that still exist, but not the viewpoints."""
    for space, state in _spaces(before):
        shading = state["shading"]
        space.shading.type = 'SOLID'  # light and colour of Solid shading can only be set in it
        space.shading.light, space.shading.color_type = shading["light"], shading["color_type"]
        space.shading.type = shading["type"]
        space.overlay.show_overlays = state["overlays"]
        space.overlay.texture_paint_mode_opacity = state["opacity"]


def face_sheet(before: list[dict], centre, size: float) -> None:
    """Look at the sheet orthographically from above, so that it fills the view."""
    for space, _ in _spaces(before):
        _look(space, 'ORTHO', (1, 0, 0, 0), centre, size * 1.25 * space.lens / 36)


def face_head(before: list[dict]) -> None:
    """Return to the viewpoints from before the sheet."""
    for space, state in _spaces(before):
        _look(space, state["perspective"], state["rotation"], state["location"], state["distance"])


def _look(space, perspective: str, rotation, location, distance: float) -> None:
    region = space.region_3d
    region.view_perspective, region.view_rotation = perspective, rotation
    region.view_location, region.view_distance = location, distance


def _spaces(before: list[dict]):
    """Yield (space, its state before) of the views that still exist."""
    for state in before:
        screen = bpy.data.screens.get(state["screen"])
        area = screen.areas[state["area"]] if screen and state["area"] < len(screen.areas) else None
        if area and area.type == 'VIEW_3D':
            yield area.spaces.active, state
