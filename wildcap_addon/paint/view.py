# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the 3D views look like while the mask is painted: flat texture, the mask tinted over it; and how they were
before."""

import bpy

SHADING = {"type": 'SOLID', "light": 'FLAT', "color_type": 'TEXTURE'}


def remember(screen: bpy.types.Screen) -> list[dict]:
    """How every 3D view of the screen looks (names and values only)."""
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
    """Shows the texture flat, in Solid shading, and the tint over it with that opacity."""
    for kept in before:
        space = _space(kept)
        if space is not None:
            space.shading.type = SHADING["type"]  # first: what the others may be depends on it
            for name, value in SHADING.items():
                setattr(space.shading, name, value)
            space.overlay.show_overlays = True
            space.overlay.texture_paint_mode_opacity = opacity


def opacity(before: list[dict]) -> float | None:
    """The tint's opacity as it is now, in the first of these views."""
    space = next(filter(None, map(_space, before)), None)
    return space.overlay.texture_paint_mode_opacity if space is not None else None


def restore(before: list[dict]) -> None:
    """Shading and overlays as they were, of the views that are still there. The viewpoint stays where the artist turned
    it to."""
    for kept in before:
        space = _space(kept)
        if space is None:
            continue
        shading = kept["shading"]
        space.shading.type = 'SOLID'  # light and colour of Solid shading can only be set in it
        space.shading.light, space.shading.color_type = shading["light"], shading["color_type"]
        space.shading.type = shading["type"]
        space.overlay.show_overlays = kept["overlays"]
        space.overlay.texture_paint_mode_opacity = kept["opacity"]


def face_sheet(before: list[dict], centre, size: float) -> None:
    """Orthographic, from straight above, the sheet filling the view."""
    for kept in before:
        space = _space(kept)
        if space is not None:
            _look(
                space,
                {
                    "perspective": 'ORTHO',
                    "rotation": (1, 0, 0, 0),
                    "location": centre,
                    "distance": size * 1.25 * space.lens / 36,
                },
            )


def face_head(before: list[dict]) -> None:
    """The viewpoints from before the sheet."""
    for kept in before:
        space = _space(kept)
        if space is not None:
            _look(space, kept)


def _look(space, saved: dict) -> None:
    region = space.region_3d
    region.view_perspective = saved["perspective"]
    region.view_rotation, region.view_location, region.view_distance = (
        saved["rotation"],
        saved["location"],
        saved["distance"],
    )


def _space(saved: dict):
    screen = bpy.data.screens.get(saved["screen"])
    area = screen.areas[saved["area"]] if screen and saved["area"] < len(screen.areas) else None
    return area.spaces.active if area and area.type == 'VIEW_3D' else None
