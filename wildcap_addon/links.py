# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Link from a .blend to its captures: kept by Save As, found after both were moved or copied, repaired by Locate.

In a session a capture's path is absolute. Saving also stores the path relative to the .blend, and opening prefers that
if it leads to a folder: a copied project works on its own captures. A .blend moved alone uses the absolute one.
"""

import os
from dataclasses import fields
from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath

import bpy

from ..core.settings.settings import STAGE_KINDS
from . import captures, preferences


def is_capture(path: Path) -> bool:
    return (path / "capture.json").is_file() or (path / "head.obj").is_file()


def move(item, path: Path) -> None:
    """Link an item to the folder `path`, with its objects, its pictures in the .blend and its settings' paths."""
    before = item.path
    for thing in bpy.data.objects:
        if thing.get(captures.HEAD_KEY) == before:
            thing[captures.HEAD_KEY] = str(path)
    for image in bpy.data.images:
        file = image.filepath if image.source == 'FILE' and not image.packed_file else ""
        new_path = _moved(file, before, path)
        if new_path and Path(new_path).is_file():
            image.filepath = bpy.path.relpath(new_path) if file.startswith("//") and bpy.data.filepath else new_path
    for stage, kind in STAGE_KINDS.items():
        settings = getattr(item, stage)
        for name in (field.name for field in fields(kind) if "path" in field.metadata):
            setattr(settings, name, _moved(getattr(settings, name), before, path) or getattr(settings, name))
    item.path = str(path)


def _moved(file: str, before: str, path: Path) -> str:
    """Return the new path of a file in the capture that moved from `before` to `path`; '' for files elsewhere."""
    place, root = _as_written(bpy.path.abspath(file)), _as_written(bpy.path.abspath(before))
    inside = bool(file) and type(place) is type(root) and place.is_relative_to(root)
    return str(path.joinpath(*place.relative_to(root).parts)) if inside else ""


def _as_written(path: str) -> PurePath:
    """Return a path as the system that wrote it reads it: a .blend goes from Windows to others, and back."""
    windows = not path.startswith("/") and bool(PureWindowsPath(path).drive)
    return PureWindowsPath(path) if windows else PurePosixPath(path)


def name(item) -> str:
    """Return the name of the capture's folder."""
    return _as_written(item.path).name


def find(item) -> Path | None:
    """Return the likely place of a missing capture.

    Searched are the .blend's folder and its subfolders, the folders of the listed captures, and the preferences' one.
    """
    parents = [captures.folder(other).root.parent for other in captures.listed()]
    parents.append(preferences.captures_folder(saved=False))
    if bpy.data.filepath:
        blend = Path(bpy.data.filepath).parent
        parents = [blend, *sorted(p for p in blend.iterdir() if p.is_dir()), *parents]
    return next((parent / name(item) for parent in parents if is_capture(parent / name(item))), None)


def missing() -> list:
    """Return the items of all scenes whose folder does not exist."""
    return [item for item in captures.listed() if not captures.folder(item).root.is_dir()]


@bpy.app.handlers.persistent
def note_on_saving(path, *_):
    """Store each capture's path relative to the file that is about to be written."""
    for item in captures.listed():
        item.from_blend = ""
        if path:
            try:
                item.from_blend = Path(os.path.relpath(captures.folder(item).root, Path(path).parent)).as_posix()
            except ValueError:  # on another drive
                continue


@bpy.app.handlers.persistent
def follow_on_opening(*_):
    """Follow the stored relative path; if that and the old path are missing, look for the name beside the .blend."""
    if not bpy.data.filepath:
        return
    blend = Path(bpy.data.filepath).parent
    for item in captures.listed():
        root, beside = captures.folder(item).root, blend / name(item)
        path = Path(os.path.normpath(blend / item.from_blend)) if item.from_blend else None
        if path is None or not path.is_dir():
            path = beside if not root.is_dir() and is_capture(beside) else root
        if path != root:
            move(item, path)


_HANDLERS = (("save_pre", note_on_saving), ("load_post", follow_on_opening))


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
