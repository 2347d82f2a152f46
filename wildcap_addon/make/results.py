# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of Make My Head: the head with its texture, the material after the solve and again in 4K, a final picture.

They wait while the artist paints, edits or moves something. Run-time state only.
"""

from dataclasses import dataclass, field

import bpy

from .. import captures, head, jobs, problems, status

MAPS = {"solve", "upscale"}
NEWS = {"texture", *MAPS}
"""Stages with visible results."""


@dataclass
class _Progress:
    """Progress of a head: stages with pending results; whether the job succeeded; whether the views show the head."""

    stages: set[str] = field(default_factory=set)
    ended: bool = False
    shown: bool = False


_making: dict[str, _Progress] = {}  # by capture folder


def begin(item, first: str | None = None) -> None:
    """Start the job. Raises Problem if it cannot start."""
    progress = _Progress()

    def then() -> None:
        progress.ended = True

    jobs.start(item, "make", first=first, then=then, on_stage=progress.stages.add)
    _making[captures.root(item)] = progress


def forget() -> None:
    _making.clear()


def has_news(root: str) -> bool:
    """Return whether `take` has something to do for a capture."""
    progress = _making.get(root)
    return progress is not None and bool(progress.ended or progress.stages & NEWS or jobs.of(root) is None)


def take(context, item) -> None:
    """Bring in new results of a capture; called in Object Mode, in the window's context."""
    root = captures.root(item)
    progress = _making.get(root)
    if progress is None:
        return
    if "texture" in progress.stages and captures.folder(item).head.is_file():
        progress.stages.discard("texture")
        try:
            bpy.ops.wildcap.bring_in_head('EXEC_DEFAULT', True)
        except RuntimeError:  # shown in the tab; maps of another shape must not go onto the head that stays
            del _making[root]
            return
    if progress.stages & MAPS:
        progress.stages -= MAPS
        bpy.ops.wildcap.assemble_material('EXEC_DEFAULT', True, unless_edited=True)
        _show(context, item, progress)
    if progress.ended or jobs.of(root) is None:  # without success the job itself shows why
        del _making[root]
    if progress.ended:
        _finish(context, item)


def _show(context, item, progress: _Progress) -> None:
    """Turn the 3D views to the head once, in Material Preview."""
    if progress.shown or bpy.app.background or context.window is None:
        return
    progress.shown = True
    head.look_at(context, captures.head(context, item))
    for area in context.window.screen.areas:
        if area.type == 'VIEW_3D' and area.spaces.active.shading.type in ('WIREFRAME', 'SOLID'):
            area.spaces.active.shading.type = 'MATERIAL'


def _finish(context, item) -> None:
    """Render a picture in Blender's render window if the head has its maps, and say that the head is ready."""
    status.refresh(context)
    if captures.head(context, item) is not None and bpy.ops.wildcap.render.poll():
        bpy.ops.wildcap.render('EXEC_DEFAULT')
    remedy = "Choose another light under Relight, or paint its shadow mask and solve again."
    problems.show(captures.root(item), problems.Notice("Your head is ready.", remedy))
