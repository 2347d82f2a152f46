# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The link from a .blend to its captures: kept by Save As, found again when both were moved or copied together, mended
by Locate.

In a session a capture's path is absolute. Saving notes beside it how it is reached from the .blend, and that wins on
opening where it leads to a folder: a copied project works on its own copy. Otherwise the absolute path holds, as for a
.blend that was moved alone.
"""

import os
from dataclasses import fields
from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath

import bpy

from ..core.capture.capture import Capture
from ..core.settings.settings import STAGE_KINDS
from . import captures, preferences


def is_capture(path: Path) -> bool:
    return (path / "capture.json").is_file() or (path / "head.obj").is_file()


def move(item, path: Path) -> None:
    """The list item, its head, cameras and landmarks, the pictures of the capture that are in the .blend, and the
    settings that name something in it, now mean the folder `path`."""
    before = item.path
    for thing in bpy.data.objects:
        if thing.get(captures.HEAD_KEY) == before:
            thing[captures.HEAD_KEY] = str(path)
    for image in bpy.data.images:
        file = image.filepath if image.source == 'FILE' and not image.packed_file else ""
        moved = _moved(file, before, path)
        if moved and Path(moved).is_file():
            image.filepath = bpy.path.relpath(moved) if image.filepath.startswith("//") and bpy.data.filepath else moved
    for stage, kind in STAGE_KINDS.items():
        settings = getattr(item, stage)
        for name in (field.name for field in fields(kind) if "path" in field.metadata):
            setattr(settings, name, _moved(getattr(settings, name), before, path) or getattr(settings, name))
    item.path = str(path)


def _moved(file: str, before: str, path: Path) -> str:
    """Where a file of the capture that was at `before` is now that it is at `path`; '' for what lies elsewhere."""
    place, root = _as_written(bpy.path.abspath(file)), _as_written(bpy.path.abspath(before))
    inside = bool(file) and type(place) is type(root) and place.is_relative_to(root)
    return str(path.joinpath(*place.relative_to(root).parts)) if inside else ""


def _as_written(path: str) -> PurePath:
    """A path as the system reads it that wrote it: a .blend goes from Windows to others, and back."""
    windows = not path.startswith("/") and bool(PureWindowsPath(path).drive)
    return PureWindowsPath(path) if windows else PurePosixPath(path)


def name(item) -> str:
    """The name of its folder."""
    return _as_written(item.path).name


def find(item) -> Path | None:
    """A missing capture where it is likely to be: beside the .blend or one folder further down, among the captures of
    the preferences, or beside another one of the scene. None where there is none of its name."""
    parents = [captures.folder(other).root.parent for other in captures.listed()]
    parents.append(preferences.captures_folder(saved=False))
    if bpy.data.filepath:
        blend = Path(bpy.data.filepath).parent
        parents = [blend, *sorted(p for p in blend.iterdir() if p.is_dir()), *parents]
    return next((parent / name(item) for parent in parents if is_capture(parent / name(item))), None)


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
        beside = blend / name(item)
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
