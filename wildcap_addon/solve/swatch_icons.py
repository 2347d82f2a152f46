# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Swatches of skin as icons, which Blender draws as sRGB whatever the scene's view transform is.

A frame marks the swatches that an estimate leaves open, a dot the one that is nearest to it.
"""

import bpy
import bpy.utils.previews
import numpy as np

SIDE = 32  # pixels, as many as Blender draws on a screen of high resolution
FRAME = 4
DOT_RADIUS = 5
LUMA = (0.299, 0.587, 0.114)  # of encoded values
_icons: bpy.utils.previews.ImagePreviewCollection | None = None


def icon(colour: tuple[float, float, float], framed: bool, dotted: bool) -> int:
    """Return the icon of a swatch of this sRGB colour."""
    global _icons
    if _icons is None:
        _icons = bpy.utils.previews.new()
    key = f"{colour} {framed} {dotted}"
    if key not in _icons:
        pixels = draw(colour, framed, dotted)
        preview = _icons.new(key)
        preview.icon_size = preview.image_size = (SIDE, SIDE)
        preview.icon_pixels_float = preview.image_pixels_float = pixels.ravel()
    return _icons[key].icon_id


def draw(colour: tuple[float, float, float], framed: bool, dotted: bool) -> np.ndarray:
    """Return the pixels of a swatch, RGBA in sRGB, float32 [SIDE, SIDE, 4]."""
    pixels = np.ones((SIDE, SIDE, 4), np.float32)
    pixels[..., :3] = colour
    rows, columns = np.indices((SIDE, SIDE)) - (SIDE - 1) / 2
    marks = np.zeros((SIDE, SIDE), bool)
    if framed:
        marks |= np.maximum(abs(rows), abs(columns)) > SIDE / 2 - FRAME
    if dotted:
        marks |= np.hypot(rows, columns) < DOT_RADIUS
    pixels[marks, :3] = 0.0 if np.dot(colour, LUMA) > 0.4 else 1.0  # seen on light and dark skin
    return pixels


def forget() -> None:
    """Free the icons."""
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
