# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit pictures without a window: the same functions as the buttons, in a bpy process in which the extension is enabled."""

from collections.abc import Iterable
from pathlib import Path

import bpy

from .. import captures, head
from ..hdri import Hdri
from . import lights, material, picture


def render_relit(capture_folder: Path, presets: Iterable[str] = tuple(lights.PRESETS), resolution: int = 640, samples: int = 32) -> list[Path]:
    """Brings in the head, assembles its material and renders renders/PRESET.png for each light. Returns the pictures.

    Empties the open file first. Raises Problem when the capture has no head or no maps.
    """
    bpy.ops.wm.read_homefile(use_empty=True)
    context = bpy.context
    item = captures.add(context, Path(capture_folder).absolute())
    obj = head.bring_in(context, item)
    material.assemble(context, item)
    return [render_light(obj, captures.folder(item).renders, preset, resolution, samples) for preset in presets]


def render_light(obj, folder: Path, light: str | Hdri, resolution: int, samples: int, wait: bool = True) -> Path:
    """One light: folder/PRESET.png, or that of the surroundings' picture."""
    path = folder / f"{light if isinstance(light, str) else light.path.stem}.png"
    picture.render(picture.set_up(obj, light, resolution, samples), path, wait)
    return path
