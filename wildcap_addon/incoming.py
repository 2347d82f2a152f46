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
    waits(its folder) says that something waits."""

    take: Callable
    waits: Callable[[str], bool]


on_results: list[Results] = []
"""What rooms do with new results of the active capture."""


def waits() -> bool:
    """Whether a room has something of the active capture to bring in."""
    root = captures.root(captures.active(bpy.context))
    return any(results.waits(root) for results in on_results)


HEAD_GOALS = ("reconstruct", "make", "solve")
"""Goals of jobs after which a head that is not in the scene comes in."""


def bring_in(ended: dict[str, str]) -> None:
    """What is new comes in at once if the artist is in Object Mode and not in the middle of a move: what rooms do with
    results, and a head whose job has ended, of the active capture. Otherwise it waits. ended: capture folder -> goal of
    the jobs that have."""
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
        made = ended.get(captures.root(item)) in HEAD_GOALS
        if made and captures.head(bpy.context, item) is None and captures.folder(item).head.is_file():
            with contextlib.suppress(RuntimeError):  # the tab shows the problem of the click
                bpy.ops.wildcap.bring_in_head('EXEC_DEFAULT', True)
