# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write renders: a file or folder gets its name when it is complete.

A still is rendered as linear EXR (scene referred, half float), from which figures are taken; its PNG is made of that
through the scene's view transform. Blender renders in a thread of its own, in which none of its data may be touched:
what is left to do waits for a timer.
"""

import shutil
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ...core.capture import unforeseen
from ...core.capture.files import place_file, place_folder, storage_problem
from ...core.capture.messages import Problem
from .. import problems, status
from ..data_blocks import find
from . import lights

SCENE = "WildCap Relight"


@dataclass
class Running:
    """Render under way: stills by the hidden EXR that each is rendered to, or a folder of frames."""

    stills: dict[Path, Path] = field(default_factory=dict)
    folder: Path | None = None
    then: Callable[[], None] | None = None


_running = Running()


def busy() -> bool:
    """Return whether Blender is rendering: it does one render at a time."""
    return bpy.app.is_job_running('RENDER')


def render_still(scene: bpy.types.Scene, path: Path, wait: bool) -> None:
    """Render a PNG and its EXR. wait=False returns at once and shows Blender's render window.

    Raises Problem if the folder cannot be written.
    """
    make_room(path)
    source = _hidden(path.with_suffix(".exr"))
    as_linear(scene)
    _start(scene, source, wait, Running(stills={source: path}), write_still=True)


def render_stills(
    scene: bpy.types.Scene, paths: list[Path], wait: bool, then: Callable[[], None], first: int = 1
) -> None:
    """Render frames of a scene, from `first` on, to PNGs in one folder; then: called when all are complete.

    Otherwise as `render_still`.
    """
    make_room(paths[0])
    scene.frame_start, scene.frame_end = first, first + len(paths) - 1
    as_linear(scene)
    frames = paths[0].with_name(".frame_####.exr")
    stills = {frames.with_name(f".frame_{i:04d}.exr"): path for i, path in enumerate(paths, first)}
    scene.render.use_persistent_data = True  # the head and its maps are the same in all frames
    _start(scene, frames, wait, Running(stills=stills, then=then), animation=True)


def render_frames(scene: bpy.types.Scene, folder: Path, name: str, count: int, wait: bool) -> None:
    """Render frames 1 to `count` to files in a new folder, which replaces the old one when it is complete.

    name: of the files, with #### for the frame's number, or of the film. Raises Problem if it cannot be written.
    """
    hidden = _hidden(folder)
    shutil.rmtree(hidden, ignore_errors=True)
    make_room(folder)
    scene.frame_start, scene.frame_end = 1, count
    if "#" in name:
        as_picture(scene)
    scene.render.use_persistent_data = True
    _start(scene, hidden / name, wait, Running(folder=folder), animation=True)


def as_picture(scene: bpy.types.Scene) -> None:
    """Have renders written as PNG."""
    _write_as(scene, 'PNG', '8')


def as_linear(scene: bpy.types.Scene) -> None:
    """Have renders written as EXR."""
    _write_as(scene, 'OPEN_EXR', '16')
    scene.render.image_settings.exr_codec = 'ZIP'


def _write_as(scene, kind: str, bits: str) -> None:
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5
        settings.media_type = 'IMAGE'
    settings.file_format, settings.color_mode, settings.color_depth = kind, 'RGB', bits
    scene.render.use_file_extension = False


def _start(scene, target: Path, wait: bool, running: Running, **options) -> None:
    global _running
    scene.render.filepath, _running = str(target), running
    _render(scene, wait, **options)


def _render(scene, wait: bool, **options) -> None:
    bpy.ops.render.render('EXEC_DEFAULT' if wait else 'INVOKE_DEFAULT', scene=scene.name, **options)
    if wait:
        _finish()


def make_room(path: Path) -> None:
    """Make the folder of a file. Raises Problem if it cannot be written."""
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
def completed(scene, *_):
    """Finish a render that was started from the window; without one, the caller waits for it."""
    if scene.name == SCENE and not bpy.app.background:
        bpy.app.timers.register(_finish_or_show, first_interval=0.0)


@bpy.app.handlers.persistent
def cancelled(scene, *_):
    """Drop a render that the artist stopped."""
    if scene.name == SCENE and not bpy.app.background:
        bpy.app.timers.register(drop, first_interval=0.0)


def drop() -> None:
    """Forget the render under way and delete what it has written."""
    if busy():  # its last moments
        bpy.app.timers.register(drop, first_interval=0.1)
        return
    running = _take_running()
    for source in running.stills:
        source.unlink(missing_ok=True)
    if running.folder is not None:
        shutil.rmtree(_hidden(running.folder), ignore_errors=True)
    _free()


def _take_running() -> Running:
    global _running
    running, _running = _running, Running()
    return running


def _finish_or_show() -> float | None:
    """Finish in a timer, where nothing catches exceptions: the tab shows them."""
    if busy():  # its last moments
        return 0.1
    try:
        _finish()
    except Problem as problem:
        problems.show("", problem)
    except OSError as error:
        problems.show("", storage_problem(error, Path(error.filename or "the render")))
    except Exception as error:
        problems.show("", unforeseen.explain(error, "Render"))
    status.redraw()
    return None


def _finish() -> None:
    """Give complete files their names."""
    running = _take_running()
    try:
        for source, path in running.stills.items():
            place_file(source, path.with_suffix(".exr"))
            _picture(path)
        if running.folder is not None:
            place_folder(_hidden(running.folder), running.folder)
    finally:
        _free()
    if running.then is not None:
        running.then()


def _free() -> None:
    scene = find(bpy.data.scenes, SCENE)
    if scene is not None:
        if scene.render.use_persistent_data:
            scene.render.use_persistent_data = False  # frees what was kept
        let_go(scene)


def let_go(scene: bpy.types.Scene) -> None:
    """Remove the head and what it wears from the relight scene: a head that the artist deletes must leave the file.

    Camera and lights stay.
    """
    for thing in list(scene.collection.objects):
        is_rig = thing.type == 'EMPTY' and thing.name.startswith(lights.RIG)
        if thing.type not in ('CAMERA', 'LIGHT') and not is_rig:
            scene.collection.objects.unlink(thing)


def _picture(path: Path) -> None:
    """Write the PNG of an EXR through the relight scene's view transform, which its metadata name."""
    scene = find(bpy.data.scenes, SCENE)
    image = bpy.data.images.load(str(path.with_suffix(".exr")))
    try:
        as_picture(scene)
        image.save_render(str(_hidden(path)), scene=scene)
    finally:
        bpy.data.images.remove(image)
    data = _hidden(path).read_bytes()
    note = b"tEXtNote\0" + view_label(scene).encode("latin-1", "replace")
    chunk = struct.pack(">I", len(note) - 4) + note + struct.pack(">I", zlib.crc32(note))
    header = 8 + 25  # the signature and IHDR, which comes first
    _hidden(path).write_bytes(data[:header] + chunk + data[header:])
    place_file(_hidden(path), path)


def view_label(scene: bpy.types.Scene) -> str:
    """Return what pictures of this scene say of their colours."""
    stops = round(scene.view_settings.exposure, 2)
    return f"View transform: {scene.view_settings.view_transform}" + (f", {stops:+g} stops" if stops else "")


def register():
    bpy.app.handlers.render_complete.append(completed)
    bpy.app.handlers.render_cancel.append(cancelled)


def unregister():
    bpy.app.handlers.render_complete.remove(completed)
    bpy.app.handlers.render_cancel.remove(cancelled)
