# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting session while .blend files are saved and opened, and after an undo.

Nothing that was painted is lost, and a file that was saved during painting reopens in it.
"""

import bpy

from . import session

KEY = "wildcap_painting"
"""Custom property of a scene, in saved files only: the painting session."""


@bpy.app.handlers.persistent
def before_save(*_):
    """Save the mask as well, as a .blend does not store painted pixels."""
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


@bpy.app.handlers.persistent
def after_undo(*_):
    """Call `settle` a moment later: during the handler the undo is not complete."""
    if not bpy.app.timers.is_registered(settle):
        bpy.app.timers.register(settle, first_interval=0.0)


def settle() -> None:
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is not None:
        with bpy.context.temp_override(window=window):
            session.after_undo(bpy.context)


_HANDLERS = (
    ("save_pre", before_save),
    ("save_post", after_save),
    ("load_pre", before_load),
    ("load_post", after_load),
    ("undo_post", after_undo),
    ("redo_post", after_undo),
)


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    session.stop()
    if bpy.app.timers.is_registered(settle):
        bpy.app.timers.unregister(settle)
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
