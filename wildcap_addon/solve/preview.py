# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a running solve in the panel."""

from ...core.capture.capture import Capture
from ..frame_icons import load

NAMES = ("albedo", "shading", "loss")
ROW_SCALE = 11.5
"""Width of a sidebar as Blender opens it, in heights of a button."""


def draw(layout, capture: Capture) -> None:
    """Draw the existing preview pictures side by side, as they are on disk now."""
    paths = [capture.preview / f"{name}.png" for name in NAMES]
    pictures = [path for path in paths if path.is_file()]
    row = layout.row(align=True)
    for path in pictures:
        column = row.column(align=True)
        column.template_icon(icon_value=load(path), scale=ROW_SCALE / len(pictures))  # as high as the column is wide
        column.label(text=path.stem.title())
