# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painting session while .blend files are saved and opened: nothing that was painted is lost, and a file that was saved in the middle of it goes on."""

import bpy

from . import session

KEY = "wildcap_painting"
"""Custom property of a scene, in the saved file only: the session in which it was saved."""


@bpy.app.handlers.persistent
def before_save(*_):
    """Painted pixels are in no .blend: whoever saves the file wants the mask saved too."""
    session.save_or_show()
    if session.active():
        bpy.context.scene[KEY] = session.note()


@bpy.app.handlers.persistent
def after_save(*_):
    _take_notes()


@bpy.app.handlers.persistent
def before_load(*_):
    session.save_or_show()
    session.forget()


@bpy.app.handlers.persistent
def after_load(*_):
    notes = _take_notes()
    if notes:
        session.go_on(notes[0])


def _take_notes() -> list[str]:
    scenes = [scene for scene in bpy.data.scenes if KEY in scene]
    notes = [scene[KEY] for scene in scenes]
    for scene in scenes:
        del scene[KEY]
    return notes


_HANDLERS = (("save_pre", before_save), ("save_post", after_save), ("load_pre", before_load), ("load_post", after_load))


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    session.stop()
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
