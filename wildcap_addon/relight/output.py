# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render leaves. A file or folder that bears its name is complete. A still is rendered as linear EXR (scene
referred, half float), from which figures are taken, and its PNG is made of that, through the scene's view transform.

Blender renders in a thread of its own, in which nothing of Blender may be touched: what is left to do waits for the
window's next moment.
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
    """A render on its way: `stills`, each by the hidden EXR it is rendered to, or a `folder` of all frames; `then` is
    called when all is complete."""

    stills: dict[Path, Path] = field(default_factory=dict)
    folder: Path | None = None
    then: Callable[[], None] | None = None


_running = Running()


def busy() -> bool:
    """Whether Blender is rendering: it does one render at a time."""
    return bpy.app.is_job_running('RENDER')


def render_still(scene: bpy.types.Scene, path: Path, wait: bool) -> None:
    """Renders `path`, a PNG, and its EXR. wait=False returns at once and shows Blender's render window. Raises Problem
    when the folder cannot be written."""
    global _running
    make_room(path)
    source = _hidden(path.with_suffix(".exr"))
    _running = Running(stills={source: path})
    as_linear(scene)
    scene.render.filepath = str(source)
    _render(scene, wait, write_still=True)


def render_stills(
    scene: bpy.types.Scene, paths: list[Path], wait: bool, then: Callable[[], None], first: int = 1
) -> None:
    """As `render_still`, for frames of the scene, from `first` on.

    Parameters
    ----------
    scene : of as many frames
    paths : their PNGs, in one folder
    wait : False returns at once
    then : called when all are there
    first : frame
    """
    global _running
    make_room(paths[0])
    scene.frame_start, scene.frame_end = first, first + len(paths) - 1
    as_linear(scene)
    scene.render.filepath = str(paths[0].with_name(".frame_####.exr"))
    _running = Running(
        stills={paths[0].with_name(f".frame_{i:04d}.exr"): path for i, path in enumerate(paths, first)}, then=then
    )
    scene.render.use_persistent_data = True  # the head and its maps are the same in all frames
    _render(scene, wait, animation=True)


def render_frames(scene: bpy.types.Scene, folder: Path, name: str, count: int, wait: bool) -> None:
    """Renders the frames of a scene; the folder replaces the one before when all are there. Raises Problem where it
    cannot be written.

    Parameters
    ----------
    scene : rendered
    folder : made anew
    name : of the files in it, with #### for the frame's number; or the film's
    count : of the frames, from 1 on
    wait : False returns at once
    """
    global _running
    hidden = _hidden(folder)
    shutil.rmtree(hidden, ignore_errors=True)
    make_room(folder)
    scene.frame_start, scene.frame_end = 1, count
    scene.render.filepath = str(hidden / name)
    _running = Running(folder=folder)
    if "#" in name:
        as_picture(scene)
    scene.render.use_persistent_data = True
    _render(scene, wait, animation=True)


def as_picture(scene: bpy.types.Scene) -> None:
    """Renders are written as PNG."""
    _write_as(scene, 'PNG', '8')


def as_linear(scene: bpy.types.Scene) -> None:
    """Renders are written as EXR."""
    _write_as(scene, 'OPEN_EXR', '16')
    scene.render.image_settings.exr_codec = 'ZIP'


def _write_as(scene, kind: str, bits: str) -> None:
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5
        settings.media_type = 'IMAGE'
    settings.file_format, settings.color_mode, settings.color_depth = kind, 'RGB', bits
    scene.render.use_file_extension = False


def _render(scene, wait: bool, **options) -> None:
    bpy.ops.render.render('EXEC_DEFAULT' if wait else 'INVOKE_DEFAULT', scene=scene.name, **options)
    if wait:
        _finish()


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
def completed(scene, *_):
    """The whole render is there. Without a window, who asked for it waits for it."""
    if scene.name == SCENE and not bpy.app.background:
        bpy.app.timers.register(_finish_or_show, first_interval=0.0)


@bpy.app.handlers.persistent
def cancelled(scene, *_):
    """The artist stopped it: what was there before stays."""
    if scene.name == SCENE and not bpy.app.background:
        bpy.app.timers.register(drop, first_interval=0.0)


def drop() -> None:
    """Forgets the render on its way and what it has written."""
    global _running
    if busy():  # its last moments
        bpy.app.timers.register(drop, first_interval=0.1)
        return
    running, _running = _running, Running()
    for source in running.stills:
        source.unlink(missing_ok=True)
    if running.folder is not None:
        shutil.rmtree(_hidden(running.folder), ignore_errors=True)
    _free()


def _finish_or_show() -> float | None:
    """As `_finish`, in a timer, where nobody catches what it raises: it is shown in the tab."""
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
    """Gives what is complete its name."""
    global _running
    running, _running = _running, Running()
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
            scene.render.use_persistent_data = False  # which frees what was kept
        let_go(scene)


def let_go(scene: bpy.types.Scene) -> None:
    """Takes the head and what it wears out of the relight scene, which nobody looks at: a head that the artist deletes
    is to be gone from the file. Camera and lights stay."""
    for thing in [
        o
        for o in scene.collection.objects
        if o.type not in ('CAMERA', 'LIGHT') and not (o.type == 'EMPTY' and o.name.startswith(lights.RIG))
    ]:
        scene.collection.objects.unlink(thing)


def _picture(path: Path) -> None:
    """The PNG of an EXR, as the relight scene shows it; its metadata say by which view transform."""
    scene = find(bpy.data.scenes, SCENE)
    image = bpy.data.images.load(str(path.with_suffix(".exr")))
    try:
        as_picture(scene)
        image.save_render(str(_hidden(path)), scene=scene)
    finally:
        bpy.data.images.remove(image)
    data = _hidden(path).read_bytes()
    note = b"tEXtNote\0" + view_label(scene).encode("latin-1", "replace")
    header = 8 + 25  # the signature and IHDR, which comes first
    _hidden(path).write_bytes(
        data[:header] + struct.pack(">I", len(note) - 4) + note + struct.pack(">I", zlib.crc32(note)) + data[header:]
    )
    place_file(_hidden(path), path)


def view_label(scene: bpy.types.Scene) -> str:
    """What pictures of this scene say of their colours."""
    return f"View transform: {scene.view_settings.view_transform}"


HANDLERS = {"render_complete": completed, "render_cancel": cancelled}


def register():
    for event, handler in HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)


def unregister():
    for event, handler in HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(handler)
