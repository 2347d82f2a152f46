# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames as icons, of their own files as they are: no data-block is made behind the artist's back."""

from pathlib import Path

import bpy
import bpy.utils.previews

_icons: bpy.utils.previews.ImagePreviewCollection | None = None


def load(path: Path) -> int:
    """The icon of a frame as it is on disk now; 0 where it is missing. Its picture is read when Blender first draws
    it."""
    global _icons
    if not path.is_file():
        return 0
    if _icons is None:
        _icons = bpy.utils.previews.new()
    key = str(path)
    _icons.pop(key, None)
    return _icons.load(key, key, 'IMAGE', force_reload=True).icon_id


def register():
    pass


def unregister():
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
