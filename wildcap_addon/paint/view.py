# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the 3D views look like while the mask is painted: flat texture, the mask tinted over it; and how they were before."""

import bpy

SHADING = {"type": 'SOLID', "light": 'FLAT', "color_type": 'TEXTURE'}
TINT_OPACITY = 0.45


def set_up(screen: bpy.types.Screen) -> list[dict]:
    """Shows texture and tint in every 3D view of the screen; returns what `restore` needs (names and values only)."""
    before = []
    for index, area in enumerate(screen.areas):
        if area.type != 'VIEW_3D':
            continue
        space = area.spaces.active
        before.append({
            "screen": screen.name, "area": index, "local": False,
            "shading": {name: getattr(space.shading, name) for name in SHADING},
            "overlays": space.overlay.show_overlays, "opacity": space.overlay.texture_paint_mode_opacity,
            "perspective": space.region_3d.view_perspective, "rotation": tuple(space.region_3d.view_rotation),
            "location": tuple(space.region_3d.view_location), "distance": space.region_3d.view_distance,
        })
        for name, value in SHADING.items():
            setattr(space.shading, name, value)
        space.overlay.show_overlays = True
        space.overlay.texture_paint_mode_opacity = TINT_OPACITY
    return before


def restore(before: list[dict]) -> None:
    """Shading, overlays and viewpoints as they were, of the views that are still there."""
    for kept in before:
        space = _space(kept)
        if space is None:
            continue
        for name, value in kept["shading"].items():
            setattr(space.shading, name, value)
        space.overlay.show_overlays = kept["overlays"]
        space.overlay.texture_paint_mode_opacity = kept["opacity"]
        _look(space, kept)


def face_sheet(before: list[dict], centre, size: float) -> None:
    """Orthographic, from straight above, the sheet filling the view."""
    for kept in before:
        space = _space(kept)
        if space is not None:
            _look(space, {"perspective": 'ORTHO', "rotation": (1, 0, 0, 0), "location": centre, "distance": size * 1.25 * space.lens / 36})


def face_head(before: list[dict]) -> None:
    """The viewpoints from before the sheet."""
    for kept in before:
        space = _space(kept)
        if space is not None:
            _look(space, kept)


def _look(space, kept: dict) -> None:
    region = space.region_3d
    region.view_perspective = kept["perspective"]
    region.view_rotation, region.view_location, region.view_distance = kept["rotation"], kept["location"], kept["distance"]


def _space(kept: dict):
    screen = bpy.data.screens.get(kept["screen"])
    area = screen.areas[kept["area"]] if screen and kept["area"] < len(screen.areas) else None
    return area.spaces.active if area and area.type == 'VIEW_3D' else None
