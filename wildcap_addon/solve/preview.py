# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures a running solve shows in the panel. Icons of their own, so that no data-block is made behind the
artist's back."""

import bpy
import bpy.utils.previews

from ...core.capture.capture import Capture

NAMES = ("albedo", "shading", "loss")
ROW_SCALE = 11.5
"""Width of a sidebar as Blender opens it, in buttons' heights"""

_icons: bpy.utils.previews.ImagePreviewCollection | None = None
_loaded: dict[str, int] = {}  # picture -> modification time of what is shown


def draw(layout, capture: Capture) -> None:
    """The preview pictures that there are, side by side, each as it is on disk now."""
    paths = [capture.preview / f"{name}.png" for name in NAMES]
    pictures = [path for path in paths if path.is_file()]
    row = layout.row(align=True)
    for path in pictures:
        column = row.column(align=True)
        column.template_icon(icon_value=icon(path), scale=ROW_SCALE / len(pictures))  # as high as a column is wide
        column.label(text=path.stem.title())


def icon(path) -> int:
    """The icon of a picture file, read again when the file is a newer one."""
    global _icons
    if _icons is None:
        _icons = bpy.utils.previews.new()
    key, time = str(path), path.stat().st_mtime_ns
    if _loaded.get(key) != time:
        _icons.pop(key, None)  # or load refuses; the icon keeps its number
        _icons.load(key, key, 'IMAGE', force_reload=True)
        _loaded[key] = time
    return _icons[key].icon_id


def forget() -> None:
    """Drops all pictures, of the last solve or when the add-on leaves."""
    global _icons
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
    _loaded.clear()
