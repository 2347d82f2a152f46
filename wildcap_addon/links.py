# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The link from a .blend to its captures: kept by Save As, found again when both were moved or copied together, mended
by Locate.

In a session a capture's path is absolute. Saving notes beside it how it is reached from the .blend, and that wins on
opening where it leads to a folder: a copied project works on its own copy. Otherwise the absolute path holds, as for a
.blend that was moved alone.
"""

import os
from pathlib import Path

import bpy

from ..core.contract.capture import Capture
from . import captures, preferences


def is_capture(path: Path) -> bool:
    return (path / "capture.json").is_file() or (path / "head.obj").is_file()


def move(item, path: Path) -> None:
    """The list item, its head, cameras and landmarks, and the pictures of the capture that are in the .blend, now mean
    the folder `path`."""
    old, before = Path(bpy.path.abspath(item.path)), item.path
    for thing in bpy.data.objects:
        if thing.get(captures.HEAD_KEY) == before:
            thing[captures.HEAD_KEY] = str(path)
    for image in bpy.data.images:
        file = (Path(bpy.path.abspath(image.filepath)) if image.source == 'FILE' and image.filepath
                and not image.packed_file else Path())
        if file.is_relative_to(old) and (path / file.relative_to(old)).is_file():
            moved = str(path / file.relative_to(old))
            image.filepath = bpy.path.relpath(moved) if image.filepath.startswith("//") and bpy.data.filepath else moved
    item.path = str(path)


def find(item) -> Path | None:
    """A missing capture where it is likely to be: beside the .blend or one folder further down, among the captures of
    the preferences, where 0.1.0 put them, or beside another one of the scene. None where there is none of its name."""
    name = Path(item.path).name
    parents = [captures.folder(other).root.parent for other in captures.listed()]
    parents += [preferences.captures_folder(saved=False), preferences.CAPTURES_0_1]
    if bpy.data.filepath:
        blend = Path(bpy.data.filepath).parent
        parents = [blend, *sorted(p for p in blend.iterdir() if p.is_dir()), *parents]
    return next((parent / name for parent in parents if is_capture(parent / name)), None)


def missing() -> list:
    """The items of all scenes whose folder is not there."""
    return [item for item in captures.listed() if not captures.folder(item).root.is_dir()]


@bpy.app.handlers.persistent
def note_on_saving(path, *_):
    """How each capture is reached from the file that is about to be written."""
    for item in captures.listed():
        item.from_blend = _relative(captures.folder(item), Path(path).parent) if path else ""


@bpy.app.handlers.persistent
def follow_on_opening(*_):
    """The folder that the note leads to from where the .blend is now; or, where neither it nor the old one is there,
    one of its name beside."""
    if not bpy.data.filepath:
        return
    blend = Path(bpy.data.filepath).parent
    for item in captures.listed():
        here = Path(os.path.normpath(blend / item.from_blend)) if item.from_blend else None
        beside = blend / Path(item.path).name
        if here is not None and here.is_dir():
            _follow(item, here)
        elif not captures.folder(item).root.is_dir() and is_capture(beside):
            _follow(item, beside)


def _follow(item, path: Path) -> None:
    if path != captures.folder(item).root:
        move(item, path)


def _relative(capture: Capture, start: Path) -> str:
    try:
        return Path(os.path.relpath(capture.root, start)).as_posix()
    except ValueError:  # on another drive
        return ""


_HANDLERS = (("save_pre", note_on_saving), ("load_post", follow_on_opening))


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
