# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender does while Make My Head runs: the head comes in when it has its texture, the material when it is solved
and again in 4K, a picture at the end.

Nothing of it happens while somebody paints, edits or moves something: it then waits for the next moment. Run-time state
only, nothing of it reaches the .blend.
"""

from dataclasses import dataclass, field

import bpy

from .. import captures, head, jobs, problems, status

GOAL = "make"
MAPS = {"solve", "upscale"}
NEWS = {"texture", *MAPS}
"""Stages after which there is something to see."""


@dataclass
class _Made:
    """What there is of a head: stages that ended; whether the job did, and well; whether the 3D view was turned to
    it."""

    stages: set[str] = field(default_factory=set)
    ended: bool = False
    shown: bool = False


_making: dict[str, _Made] = {}  # capture folder -> how far it is


def begin(item, first: str | None = None) -> None:
    """Starts the job. Raises Problem when it cannot."""
    root = captures.root(item)
    made = _Made()
    jobs.start(item, GOAL, first=first, then=lambda: setattr(made, "ended", True), on_stage=made.stages.add)
    _making[root] = made


def forget() -> None:
    _making.clear()


def has_news(root: str) -> bool:
    """Whether there is something of a capture that `take` has not taken in."""
    made = _making.get(root)
    return made is not None and bool(made.ended or made.stages & NEWS or jobs.of(root) is None)


def take(context, item) -> None:
    """Takes in what is new of a capture's head; called in Object Mode, in the window's context."""
    root = captures.root(item)
    made = _making.get(root)
    if made is None:
        return
    if "texture" in made.stages and captures.folder(item).head.is_file():
        made.stages.discard("texture")
        try:
            bpy.ops.wildcap.bring_in_head('EXEC_DEFAULT', True)
        except RuntimeError:  # the tab shows why; maps of another shape do not go onto the head that stays
            del _making[root]
            return
    if made.stages & MAPS:
        made.stages -= MAPS
        bpy.ops.wildcap.assemble_material('EXEC_DEFAULT', True, unless_edited=True)
        _show(context, item, made)
    if made.ended:
        del _making[root]
        _finish(context, item)
    elif jobs.of(root) is None:  # cancelled, or failed: its own words say so
        del _making[root]


def _show(context, item, progress: _Made) -> None:
    """Turns the 3D views to the head once, lit as Material Preview lights it."""
    if progress.shown or bpy.app.background or context.window is None:
        return
    progress.shown = True
    head.look_at(context, captures.head(context, item))
    for area in context.window.screen.areas:
        if area.type == 'VIEW_3D' and area.spaces.active.shading.type in ('WIREFRAME', 'SOLID'):
            area.spaces.active.shading.type = 'MATERIAL'


def _finish(context, item) -> None:
    """A picture, in Blender's render window, where the head has its maps; and a word that it is there."""
    status.refresh(context)
    if captures.head(context, item) is not None and bpy.ops.wildcap.render.poll():
        bpy.ops.wildcap.render('EXEC_DEFAULT')
    problems.show(
        captures.root(item),
        problems.Notice(
            "Your head is ready.", "Choose another light under Relight, or paint its shadow mask and solve again."
        ),
    )
