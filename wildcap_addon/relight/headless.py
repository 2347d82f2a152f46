# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit pictures without a window: the same functions as the buttons, in a bpy process in which the extension is enabled."""

from collections.abc import Iterable
from pathlib import Path

import bpy

from ...core.contract.messages import Problem
from .. import captures, colours, hdri, head
from ..hdri import Hdri
from . import contact_sheet, lights, material, output, picture, reel

ALL = tuple(lights.PRESETS)
FRAMES_PER_SECOND = 24


def render_relit(capture_folder: Path, names: Iterable[str | Hdri] = ALL, resolution: int = 640, samples: int = 32) -> list[Path]:
    """Brings in the head, assembles its material and renders renders/NAME.png and the linear renders/NAME.exr for each light: a preset, one of Blender's
    worlds by its name, or a picture. Returns the PNGs.

    Empties the open file first. Raises Problem when the capture has no head or no maps, or there is no such light.
    """
    chosen = [light_of(name) for name in names]
    obj, item = open_head(capture_folder)
    return [render_light(obj, captures.folder(item).renders, light, resolution, samples) for light in chosen]


def render_contact_sheet(capture_folder: Path, resolution: int = 512, samples: int = 32, view: str = colours.VIEWS[0]) -> Path:
    """As `render_relit`, in all presets, joined to renders/contact_sheet.png, which is returned."""
    obj, item = open_head(capture_folder)
    return contact_sheet.render(obj, captures.folder(item).renders, True, resolution=resolution, samples=samples, view=view)


def render_turntable(
    capture_folder: Path, name: str | Hdri = ALL[0], turns: str = 'HEAD', frames: int = 48, film: bool = False, resolution: int = 512, samples: int = 32,
) -> Path:
    """The 'HEAD' or the 'LIGHT' once around, to renders/turntable/, which is returned: PNG frames, or one film. Raises Problem as `render_relit` does."""
    light = light_of(name)
    obj, item = open_head(capture_folder)
    return turntable(obj, captures.folder(item).renders, light, turns, frames, film, True, resolution=resolution, samples=samples)


def turntable(obj, renders: Path, light: str | Hdri, turns: str, frames: int, film: bool, wait: bool, **look) -> Path:
    """renders/turntable/. `look`: as picture.set_up takes it. Raises Problem where a film is asked of a Blender that cannot write one."""
    if film and not reel.can_film():
        raise Problem("This Blender was built without FFmpeg: it cannot write MP4.", "Choose PNG frames.")
    scene = reel.turning(obj, light, turns, frames, **look)
    if film:
        reel.as_film(scene, FRAMES_PER_SECOND)
    folder = renders / "turntable"
    output.frames(scene, folder, "turntable.mp4" if film else "####.png", frames, wait)
    return folder


def light_of(name: str | Hdri) -> str | Hdri:
    """A preset's name as it is, else the world that Blender knows by it."""
    return name if isinstance(name, Hdri) or name in lights.PRESETS or name in lights.NAMED_BEFORE else hdri.named(name)


def open_head(capture_folder: Path):
    """A file with nothing but the capture's head in its material, and the capture's list item."""
    bpy.ops.wm.read_homefile(use_empty=True)
    item = captures.add(bpy.context, Path(capture_folder).absolute())
    obj = head.bring_in(bpy.context, item)
    material.assemble(bpy.context, item)
    return obj, item


def render_light(
    obj, folder: Path, light: str | Hdri, resolution: int, samples: int, turn: float = 0.0, view: str = colours.VIEWS[0], wait: bool = True,
) -> Path:
    """One light: folder/PRESET.png and folder/PRESET.exr, or those of the surroundings' picture."""
    path = folder / f"{light if isinstance(light, str) else light.path.stem}.png"
    output.still(picture.set_up(obj, light, resolution, samples, turn, view), path, wait)
    return path
