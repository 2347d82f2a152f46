# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Retouched maps after a change of the layers: the worker makes them, and the head's material takes them.

Begun by itself when the painting of a layer ends. Run-time state only.
"""

import contextlib

import bpy

from ...core.capture import freshness, stages
from ...core.capture.messages import Problem
from .. import batches, captures, jobs, layers, preferences, problems, status

_ended: set[str] = set()  # captures whose new maps are to go onto the head


def after_painting(root: str) -> None:
    """Begin the update of a capture whose layer was painted, if nothing else works on it; the button is left else."""
    item = next(iter(captures.of_root(root)), None)
    if item is None or preferences.python() is None or jobs.of(root) is not None or batches.works_on(root):
        return
    try:
        status.refresh(bpy.context)
        if is_outdated(item):
            begin(item)
    except Problem as problem:
        problems.show(root, problem)


def is_outdated(item) -> bool:
    """Return whether the maps do not show the layers as they are, as far as is known."""
    known = status.of(item)
    return known is not None and known.stages.get("retouch") not in (None, *freshness.FINISHED)


def begin(item) -> None:
    """Start the stages that the layers change. Raises Problem if they cannot start."""
    known, root, capture = status.of(item), captures.root(item), captures.folder(item)
    if not all(capture.has(name) for name in stages.SOLVED):  # the sample head's, before its first solve
        raise Problem("The layers are kept, and come into the maps with the first solve.", "Click Solve.")
    has_4k = known is not None and known.stages.get("upscale") in freshness.FINISHED
    jobs.start(item, "tool", first="retouch" if has_4k else "upscale", then=lambda: _ended.add(root))


def waits(root: str) -> bool:
    """Return whether new maps of a capture are to go onto its head."""
    return root in _ended


def take(context, item) -> None:
    """Put new maps onto the head of a capture, unless somebody changed its material; called in Object Mode."""
    root = captures.root(item)
    if root not in _ended:
        return
    _ended.discard(root)
    layers.take_in(item)
    if captures.head(context, item) is not None:
        with contextlib.suppress(RuntimeError):  # the operator has shown the problem in the tab
            bpy.ops.wildcap.assemble_material('EXEC_DEFAULT', True, unless_edited=True)


def forget() -> None:
    """Forget what waits."""
    _ended.clear()
