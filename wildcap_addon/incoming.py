# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""New results of the active capture come into the scene when nobody is in the middle of a move."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from . import captures, status


@dataclass(frozen=True)
class Results:
    """take(context, list item) is called in Object Mode when nobody is in the middle of a move, for as long as
    wanted(its folder) says that something waits."""

    take: Callable
    wanted: Callable[[str], bool]


on_results: list[Results] = []
"""What rooms do with new results of the active capture."""


def waits() -> bool:
    """Whether a room has something of the active capture to bring in."""
    root = captures.root(captures.active(bpy.context))
    return any(results.wanted(root) for results in on_results)


def bring_in(ended: bool) -> None:
    """What is new comes in at once if the artist is in Object Mode and not in the middle of a move: a new head when a
    job has ended, and what rooms do with results. Otherwise it waits."""
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
        if ended and captures.head(bpy.context, item) is None and captures.folder(item).head.is_file():
            with contextlib.suppress(RuntimeError):  # the tab shows the problem of the click
                bpy.ops.wildcap.bring_in_head('EXEC_DEFAULT', True)
