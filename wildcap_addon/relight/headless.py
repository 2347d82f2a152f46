# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit pictures without a window, in a bpy process in which the extension is enabled.

A light's name is a preset's, or that of one of Blender's worlds.
"""

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


@dataclass(frozen=True)
class Turn:
    """Once around: what turns, 'HEAD' or 'LIGHT', in how many frames, and whether they become one MP4."""

    turns: str
    frames: int
    film: bool


def render_relit(
    capture_folder: Path,
    names: Iterable[str] = ALL,
    resolution: int = 640,
    samples: int = 32,
    view: str = colours.VIEWS[0],
    exposure: float = 0.0,
) -> list[Path]:
    """Render a capture's head under each light to renders/NAME.png and the linear NAME.exr; return the PNGs.

    view, exposure: view transform of the PNG, and stops by which it is brighter. Empties the open file first. Raises
    Problem if the capture has no head or maps, or there is no such light.
    """
    chosen = [light_of(name) for name in names]
    obj, renders = _open_to_render(capture_folder)
    settings = RenderSettings(resolution, samples, view=view, exposure=exposure)
    return [render_light(obj, renders, light, settings) for light in chosen]


def render_contact_sheet(
    capture_folder: Path,
    resolution: int = 512,
    samples: int = 32,
    view: str = colours.VIEWS[0],
    exposure: float = 0.0,
) -> Path:
    """Render all presets to renders/contact_sheet.png; otherwise as `render_relit`."""
    obj, renders = _open_to_render(capture_folder)
    settings = RenderSettings(resolution, samples, view=view, exposure=exposure)
    return contact_sheet.render(obj, renders, True, settings)


def render_turntable(
    capture_folder: Path,
    name: str = ALL[0],
    turns: str = 'HEAD',
    frames: int = 48,
    film: bool = False,
    resolution: int = 512,
    samples: int = 32,
    view: str = colours.VIEWS[0],
    exposure: float = 0.0,
) -> Path:
    """Render a capture's head or its light once around to renders/turntable/; otherwise as `render_relit`."""
    light = light_of(name)
    obj, renders = _open_to_render(capture_folder)
    settings = RenderSettings(resolution, samples, view=view, exposure=exposure)
    return turntable(obj, renders, light, Turn(turns, frames, film), settings, True)


def turntable(obj, renders: Path, light: str | Hdri, turn: Turn, settings: RenderSettings, wait: bool) -> Path:
    """Render a head, or its light, once around; return the folder of the frames or the film.

    wait=False returns at once. Raises Problem for a film in a Blender that cannot write one or in an odd size, and for
    the turn of a light that is the same all round.
    """
    if turn.film and not reel.can_film():
        raise Problem("This Blender was built without FFmpeg: it cannot write MP4.", "Choose PNG frames.")
    if turn.film and settings.resolution % 2:
        raise Problem("MP4 needs an even resolution.", "Choose an even one, or PNG frames.")
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


def light_of(name: str) -> str | Hdri:
    """Return a preset's name as it is, otherwise Blender's world of that name."""
    return name if name in lights.PRESETS or name in lights.NAMED_BEFORE else hdri.named(name)


def open_head(capture_folder: Path):
    """Open an empty file with only the capture's head in its material; return the head and the capture's list item."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.cycles.device = 'CPU'  # whatever the start-up file says: the same pictures on every machine
    item = captures.add(bpy.context, Path(capture_folder).absolute())
    obj = head.bring_in(bpy.context, item)
    material.assemble(bpy.context, item)
    return obj, item


def _open_to_render(capture_folder: Path) -> tuple[bpy.types.Object, Path]:
    obj, item = open_head(capture_folder)
    return obj, captures.folder(item).renders


def render_light(obj, folder: Path, light: str | Hdri, settings: RenderSettings, wait: bool = True) -> Path:
    """Render a head under one light to a PNG and an EXR in a folder; return the PNG. wait=False returns at once."""
    path = folder / f"{light if isinstance(light, str) else light.path.stem}.png"
    output.render_still(settings.scene(obj, light), path, wait)
    return path
