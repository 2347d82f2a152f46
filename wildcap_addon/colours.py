# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour spaces and views chosen by purpose: a studio's OCIO configuration need not have Blender's names.

Data (masks, normals, specular) uses OCIO's role `data`; pictures use the usual names of sRGB for textures, else the
role `default_byte`, which a configuration gives to pictures of 8 bits.

Colours as numbers are linear with sRGB's primaries (Rec.709) here and in the capture; the scene's working space, in
which Blender expects those of nodes, lamps and attributes, may have others (ACEScg, Rec.2020).
"""

import bpy
import numpy as np
from mathutils import Color

SRGB = (
    "sRGB",
    "sRGB - Texture",
    "Utility - sRGB - Texture",
    "Input - Generic - sRGB - Texture",
    "srgb_texture",
    "srgb_tx",
    "sRGB Encoded Rec.709 (sRGB)",
)
"""Names in Blender, ACES 1.3 and newer, ACES 1.0 to 1.2, the same by its family, their short forms, and the Color
Interop Forum's (2024)."""
VIEWS = ("Standard", "Un-tone-mapped", "Raw")
"""Views that show colours unchanged."""
ROUNDED = 1e-4
"""Error of a configuration's own matrices, which have some five digits."""


def as_srgb(image: bpy.types.Image) -> None:
    """Read a picture as sRGB for textures."""
    if image.colorspace_settings.name not in SRGB:
        _choose(image.colorspace_settings, "name", (*SRGB, of_pictures()))


def as_data(image: bpy.types.Image) -> None:
    """Read a picture as numbers without a colour space."""
    if not image.colorspace_settings.is_data:  # setting it makes Blender reload the file
        image.colorspace_settings.is_data = True


def srgb_to_linear(srgb: np.ndarray) -> np.ndarray:
    """Decode sRGB in [0, 1] (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear light as sRGB."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.clip(linear, 0, 1) ** (1 / 2.4) - 0.055)


def to_working(linear: np.ndarray | tuple) -> np.ndarray:
    """Convert linear colours [..., 3] with sRGB's primaries to the scene's working space."""
    return np.asarray(linear) @ _towards_working()


def from_working(linear: np.ndarray | tuple) -> np.ndarray:
    """Convert colours [..., 3] in the scene's working space to linear ones with sRGB's primaries."""
    return np.asarray(linear) @ np.linalg.inv(_towards_working())


def _towards_working() -> np.ndarray:
    """Return the matrix [3, 3] for rows; exactly the identity if the working space has sRGB's primaries."""
    matrix = np.array([Color(axis).from_rec709_linear_to_scene_linear()[:] for axis in np.eye(3)])
    return np.eye(3) if np.abs(matrix - np.eye(3)).max() < ROUNDED else matrix


def show_by(scene: bpy.types.Scene, view: str, exposure: float = 0.0) -> None:
    """Show a scene by a view transform, `exposure` stops brighter; if there is none of that name, unchanged."""
    _choose(scene.view_settings, "view_transform", (view, *VIEWS))
    _choose(scene.view_settings, "look", ("None",))
    scene.view_settings.exposure, scene.view_settings.gamma = exposure, 1.0


def of_pictures() -> str:
    """Return the configuration's space for pictures of 8 bits."""
    image = bpy.data.images.new("WildCap Colour Space", 1, 1)
    try:
        return image.colorspace_settings.name
    finally:
        bpy.data.images.remove(image)


def missing(image: bpy.types.Image) -> str:
    """Return a warning if a picture is not read as sRGB; else ''."""
    name = image.colorspace_settings.name
    if name in SRGB:
        return ""
    return f"This OCIO configuration has no sRGB by a known name: pictures are read as {name}, its space for 8 bits."


def missing_view(scene: bpy.types.Scene) -> str:
    """Return a warning if no view shows a render unchanged; else ''."""
    settings = scene.view_settings
    now, look = settings.view_transform, settings.look  # Blender drops a look that another view does not have
    try:
        if _choose(settings, "view_transform", VIEWS):
            return ""
        return f"This OCIO configuration has no view without a look: the render is shown by {now}."
    finally:
        settings.view_transform, settings.look = now, look


def _choose(settings, name: str, values: tuple[str, ...]) -> str | None:
    """Set a property to the first value that exists, and return that."""
    for value in values:
        try:
            setattr(settings, name, value)
            return value
        except TypeError:  # not in the enumeration
            continue
    return None
