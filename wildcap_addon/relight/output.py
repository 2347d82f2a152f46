# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render leaves. A file or folder that bears its name is complete; each still has its linear EXR (scene referred, half float) beside it, from which
figures are taken: no view transform has touched it.

Blender renders in a thread of its own: what makes data-blocks waits for the window's next moment.
"""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ...core.capture import storage_problem

SCENE = "WildCap Relight"


@dataclass
class Running:
    """A render on its way: `stills` by frame, or a `folder` of all frames; `then` is called when all is complete."""

    stills: dict[int, Path] = field(default_factory=dict)
    folder: Path | None = None
    then: Callable[[], None] | None = None


_running = Running()


def busy() -> bool:
    """Whether Blender is rendering: it does one render at a time."""
    return bpy.app.is_job_running('RENDER')


def still(scene: bpy.types.Scene, path: Path, wait: bool) -> None:
    """Renders `path`, a PNG, and its EXR. wait=False returns at once and shows Blender's render window. Raises Problem when the folder cannot be written."""
    global _running
    make_room(path)
    _running = Running(stills={scene.frame_current: path})
    scene.render.filepath = str(_hidden(path))
    bpy.ops.render.render('EXEC_DEFAULT' if wait else 'INVOKE_DEFAULT', write_still=True, scene=scene.name)


def stills(scene: bpy.types.Scene, paths: list[Path], wait: bool, then: Callable[[], None]) -> None:
    """As `still`, for the frames 1, 2, ... of the scene; `then` is called when all are there."""
    global _running
    make_room(paths[0])
    scene.frame_start, scene.frame_end = 1, len(paths)
    _running = Running(stills=dict(enumerate(paths, 1)), then=then)
    _animate(scene, _hidden(paths[0]).with_name(".frame_####.png"), wait)


def frames(scene: bpy.types.Scene, folder: Path, name: str, count: int, wait: bool) -> None:
    """Renders the frames 1 to `count` to folder/name, which holds #### or is a film's; the folder replaces the one before when all are there."""
    global _running
    make_room(folder / name)
    hidden = _hidden(folder)
    shutil.rmtree(hidden, ignore_errors=True)
    scene.frame_start, scene.frame_end = 1, count
    _running = Running(folder=folder)
    _animate(scene, hidden / name, wait)


def _animate(scene, path: Path, wait: bool) -> None:
    scene.render.filepath = str(path)
    scene.render.use_persistent_data = True  # the head and its maps are the same in all frames
    bpy.ops.render.render('EXEC_DEFAULT' if wait else 'INVOKE_DEFAULT', animation=True, scene=scene.name)


def make_room(path: Path) -> None:
    """Makes the folder of a file. Raises Problem when it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        probe = _hidden(path)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise storage_problem(error, path) from error


def _hidden(path: Path) -> Path:
    return path.with_name(f".{path.name}")


@bpy.app.handlers.persistent
def written(scene, *_):
    """Gives a finished picture its name, its EXR first."""
    path = _running.stills.get(scene.frame_current)
    if scene.name != SCENE or path is None:
        return
    source = Path(scene.render.frame_path(frame=scene.frame_current)) if "#" in scene.render.filepath else Path(scene.render.filepath)
    if source.is_file():
        exr = path.with_suffix(".exr")
        _save_linear(scene, _hidden(exr))
        os.replace(_hidden(exr), exr)
        os.replace(source, path)


@bpy.app.handlers.persistent
def completed(scene, *_):
    """The whole render is there."""
    if scene.name == SCENE:
        if bpy.app.background:
            _finish()
        else:
            bpy.app.timers.register(_finish, first_interval=0.0)


@bpy.app.handlers.persistent
def cancelled(scene, *_):
    """The artist stopped it: pictures that are complete stay, a folder that is not goes."""
    global _running
    if scene.name == SCENE:
        if _running.folder is not None:
            shutil.rmtree(_hidden(_running.folder), ignore_errors=True)
        _running = Running()


def _finish() -> None:
    global _running
    running, _running = _running, Running()
    scene = bpy.data.scenes.get(SCENE)
    if scene is not None:
        scene.render.use_persistent_data = False  # which frees what was kept
    if running.folder is not None:
        shutil.rmtree(running.folder, ignore_errors=True)
        os.replace(_hidden(running.folder), running.folder)
    if running.then is not None:
        running.then()


def _save_linear(scene, path: Path) -> None:
    """The render's scene referred values, RGB half float."""
    settings = scene.render.image_settings
    before = settings.file_format, settings.color_mode, settings.color_depth
    settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '16'
    settings.exr_codec = 'ZIP'
    try:
        bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    finally:
        settings.file_format, settings.color_mode, settings.color_depth = before


HANDLERS = {"render_write": written, "render_complete": completed, "render_cancel": cancelled}


def register():
    for event, handler in HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)


def unregister():
    for event, handler in HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(handler)
