# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture files as icons, without data-blocks."""

from pathlib import Path

import bpy
import bpy.utils.previews

_icons: bpy.utils.previews.ImagePreviewCollection | None = None
_times: dict[str, int] = {}  # picture -> its modification time, ns


def load(path: Path) -> int:
    """Return the icon of a picture as it is on disk now; 0 if it is missing. Blender reads it when it draws it."""
    global _icons
    if not path.is_file():
        return 0
    if _icons is None:
        _icons = bpy.utils.previews.new()
    key, time = str(path), path.stat().st_mtime_ns
    if _times.get(key) != time:
        _icons.pop(key, None)  # or load refuses; the icon keeps its number
        _icons.load(key, key, 'IMAGE', force_reload=True)
        _times[key] = time
    return _icons[key].icon_id


def register():
    pass


def unregister():
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
    _times.clear()
