# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour spaces and views by what they are for, as a studio's own OCIO configuration need not have Blender's names.

Data (masks, normals, specular) goes by OCIO's role `data`; pictures by the names that sRGB for textures has in the
usual configurations, else by the role `default_byte`, which a configuration gives to pictures of 8 bits.

Numbers of a colour are linear light of sRGB's primaries (Rec.709) here and in the capture; the scene's working space,
in which Blender takes those of nodes, lamps and attributes, may have others (ACEScg, Rec.2020).
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
"""Of Blender, ACES 1.3 and newer, ACES 1.0 to 1.2, the same by its family, their short forms, and the Color Interop
Forum's (2024)."""
VIEWS = ("Standard", "Un-tone-mapped", "Raw")
"""Views that show colours as they are."""
ROUNDED = 1e-4
"""What a configuration's own matrices, of some five digits, are off by"""


def as_srgb(image: bpy.types.Image) -> None:
    """Reads a picture as sRGB for textures."""
    if image.colorspace_settings.name not in SRGB:
        _choose(image.colorspace_settings, "name", (*SRGB, of_pictures()))


def as_data(image: bpy.types.Image) -> None:
    """Reads numbers as they are."""
    if not image.colorspace_settings.is_data:  # setting it has Blender read the file anew
        image.colorspace_settings.is_data = True


def srgb_to_linear(srgb: np.ndarray) -> np.ndarray:
    """Decode sRGB in [0, 1] (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear light as sRGB."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.clip(linear, 0, 1) ** (1 / 2.4) - 0.055)


def to_working(linear: np.ndarray | tuple) -> np.ndarray:
    """Linear colours [..., 3] of sRGB's primaries in the scene's working space."""
    return np.asarray(linear) @ _towards_working()


def from_working(linear: np.ndarray | tuple) -> np.ndarray:
    """Colours [..., 3] in the scene's working space as linear ones of sRGB's primaries."""
    return np.asarray(linear) @ np.linalg.inv(_towards_working())


def _towards_working() -> np.ndarray:
    """[3, 3], for rows; exactly the identity where the working space has sRGB's primaries."""
    matrix = np.array([Color(axis).from_rec709_linear_to_scene_linear()[:] for axis in np.eye(3)])
    return np.eye(3) if np.abs(matrix - np.eye(3)).max() < ROUNDED else matrix


def show_by(scene: bpy.types.Scene, view: str) -> None:
    """Has a scene shown by a view transform; where the configuration has none of that name, as it is."""
    _choose(scene.view_settings, "view_transform", (view, *VIEWS))
    _choose(scene.view_settings, "look", ("None",))
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0


def of_pictures() -> str:
    """The space that the configuration gives to a picture of 8 bits."""
    image = bpy.data.images.new("WildCap Colour Space", 1, 1)
    try:
        return image.colorspace_settings.name
    finally:
        bpy.data.images.remove(image)


def missing(image: bpy.types.Image) -> str:
    """What the artist is to know about how a picture is read; '' where it is read as sRGB."""
    name = image.colorspace_settings.name
    return (
        ""
        if name in SRGB
        else f"This OCIO configuration has no sRGB by a known name: pictures are read as {name}, its space for 8 bits."
    )


def missing_view(scene: bpy.types.Scene) -> str:
    """What the artist is to know about how a render will look; '' where it looks as it is."""
    settings = scene.view_settings
    now, look = settings.view_transform, settings.look  # Blender drops a look that another view does not have
    try:
        return (
            ""
            if _choose(settings, "view_transform", VIEWS)
            else f"This OCIO configuration has no view without a look: the render is shown by {now}."
        )
    finally:
        settings.view_transform = now
        settings.look = look


def _choose(settings, name: str, names: tuple[str, ...]) -> str | None:
    """Sets the first of the names that there is; None where there is none."""
    for value in names:
        try:
            setattr(settings, name, value)
            return value
        except TypeError:  # Blender's word for a name that is not in the enumeration
            continue
    return None
