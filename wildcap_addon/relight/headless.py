# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit pictures without a window: the same functions as the buttons, in a bpy process in which the extension is
enabled."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...core.capture.messages import Problem
from .. import captures, colours, hdri, head
from ..hdri import Hdri
from . import contact_sheet, lights, material, output, reel
from .picture import RenderSettings

ALL = tuple(lights.PRESETS)
FRAMES_PER_SECOND = 24


def render_relit(
    capture_folder: Path, names: Iterable[str | Hdri] = ALL, resolution: int = 640, samples: int = 32
) -> list[Path]:
    """Brings in the head, assembles its material and renders renders/NAME.png and the linear renders/NAME.exr for each
    light. Empties the open file first.

    Parameters
    ----------
    capture_folder : with head and maps
    names : of lights: a preset, one of Blender's worlds by its name, or a picture
    resolution : pixels of a side
    samples : of Cycles

    Returns
    -------
    The PNGs.

    Raises
    ------
    Problem
        Where the capture has no head or no maps, or there is no such light.
    """
    chosen = [light_of(name) for name in names]
    obj, item = open_head(capture_folder)
    return [
        render_light(obj, captures.folder(item).renders, light, RenderSettings(resolution, samples)) for light in chosen
    ]


def render_contact_sheet(
    capture_folder: Path, resolution: int = 512, samples: int = 32, view: str = colours.VIEWS[0]
) -> Path:
    """As `render_relit`, in all presets, joined in one picture.

    Parameters
    ----------
    capture_folder, samples : as `render_relit` has them
    resolution : pixels of a side of each picture
    view : the view transform

    Returns
    -------
    renders/contact_sheet.png.
    """
    obj, item = open_head(capture_folder)
    return contact_sheet.render(
        obj, captures.folder(item).renders, True, RenderSettings(resolution, samples, view=view)
    )


def render_turntable(
    capture_folder: Path,
    name: str | Hdri = ALL[0],
    turns: str = 'HEAD',
    frames: int = 48,
    film: bool = False,
    resolution: int = 512,
    samples: int = 32,
) -> Path:
    """The head or its light once around.

    Parameters
    ----------
    capture_folder, resolution, samples : as `render_relit` has them
    name : of the light, likewise
    turns, frames, film : as Turn has them

    Returns
    -------
    renders/turntable/, with PNG frames or one film.

    Raises
    ------
    Problem
        As `render_relit` and `turntable` do.
    """
    light = light_of(name)
    obj, item = open_head(capture_folder)
    return turntable(
        obj, captures.folder(item).renders, light, Turn(turns, frames, film), RenderSettings(resolution, samples), True
    )


@dataclass(frozen=True)
class Turn:
    """Once around: turns is 'HEAD' or 'LIGHT', in so many frames; film: as one MP4, not as PNG frames."""

    turns: str
    frames: int
    film: bool


def turntable(obj, renders: Path, light: str | Hdri, turn: Turn, settings: RenderSettings, wait: bool) -> Path:
    """Renders a head, or its light, once around.

    Parameters
    ----------
    obj : the head
    renders : the folder that gets turntable/
    light : a preset's name, or a picture of surroundings
    turn : what turns, and what becomes of it
    settings : of each frame
    wait : False returns at once

    Returns
    -------
    The folder of the frames or the film.

    Raises
    ------
    Problem : where a film is asked of a Blender that cannot write one, or in an odd size; where the light is to turn,
        and is the same all round
    """
    if turn.film and not reel.can_film():
        raise Problem("This Blender was built without FFmpeg: it cannot write MP4.", "Choose PNG frames.")
    if turn.film and settings.resolution % 2:
        raise Problem("MP4 needs a resolution that is even.", "Choose an even one, or PNG frames.")
    if turn.turns == 'LIGHT' and isinstance(light, str) and not lights.preset(light).lamps:
        raise Problem(
            "This light is the same from every side: turning it changes nothing.",
            "Choose another light, or turn the head.",
        )
    scene = reel.animate_turn(obj, light, turn.turns, turn.frames, settings)
    if turn.film:
        reel.as_film(scene, FRAMES_PER_SECOND)
    folder = renders / "turntable"
    output.render_frames(scene, folder, "turntable.mp4" if turn.film else "####.png", turn.frames, wait)
    return folder


def light_of(name: str | Hdri) -> str | Hdri:
    """A preset's name as it is, else the world that Blender knows by it."""
    return name if isinstance(name, Hdri) or name in lights.PRESETS or name in lights.NAMED_BEFORE else hdri.named(name)


def open_head(capture_folder: Path):
    """A file with nothing but the capture's head in its material, and the capture's list item."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.cycles.device = 'CPU'  # whatever the start-up file says: the same pictures on every machine
    item = captures.add(bpy.context, Path(capture_folder).absolute())
    obj = head.bring_in(bpy.context, item)
    material.assemble(bpy.context, item)
    return obj, item


def render_light(obj, folder: Path, light: str | Hdri, settings: RenderSettings, wait: bool = True) -> Path:
    """Renders a head under one light.

    Parameters
    ----------
    obj : the head
    folder : takes PRESET.png and PRESET.exr, or those of the surroundings' picture
    light : a preset's name, or a picture of surroundings
    settings : of the picture
    wait : False returns at once

    Returns
    -------
    The PNG's path.
    """
    path = folder / f"{light if isinstance(light, str) else light.path.stem}.png"
    output.render_still(settings.scene(obj, light), path, wait)
    return path
