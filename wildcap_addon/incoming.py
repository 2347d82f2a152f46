# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""New results of the active capture, brought into the scene between the artist's own operations."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from . import captures, status

HEAD_GOALS = ("reconstruct", "make", "solve")
"""Goals of jobs after which a head that is missing from the scene is brought in."""


@dataclass(frozen=True)
class Results:
    """Results of a room: take(context, list item) is called in Object Mode while waits(capture folder) is true."""

    take: Callable
    waits: Callable[[str], bool]


on_results: list[Results] = []
"""Rooms add theirs as they register."""


def waits() -> bool:
    """Return whether a room has something of the active capture to bring in."""
    root = captures.root(captures.active(bpy.context))
    return any(results.waits(root) for results in on_results)


def bring_in(ended: dict[str, str]) -> None:
    """Bring in results of the active capture, and its head if its job has ended.

    In another mode or during a modal operation, nothing happens until a later call. `ended` maps the capture folders of
    jobs that have ended to their goals.
    """
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or window.modal_operators:
        return
    with bpy.context.temp_override(window=window):
        if ended:
            status.refresh(bpy.context)
        item = captures.active(bpy.context)
        if bpy.context.mode != 'OBJECT' or item is None:
            return
        for results in on_results:
            results.take(bpy.context, item)
        needs_head = ended.get(captures.root(item)) in HEAD_GOALS
        if needs_head and captures.head(bpy.context, item) is None and captures.folder(item).head.is_file():
            with contextlib.suppress(RuntimeError):  # the operator has shown the problem in the tab
                bpy.ops.wildcap.bring_in_head('EXEC_DEFAULT', True)
