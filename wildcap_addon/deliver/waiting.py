# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Deliveries that wait for their mesh once the worker has written the maps.

Blender adds it at once in Object Mode outside a modal operator, otherwise at the next click. Run-time state only, per
capture folder.
"""

from pathlib import Path

import bpy

from ...core.capture import delivery_plan, provenance
from ...core.capture.delivery_plan import PACKING, DeliveryPlan
from ...core.capture.messages import Problem
from .. import captures, problems
from . import files, stand

_ready: dict[str, DeliveryPlan] = {}
_last: dict[str, Path] = {}


def ready(root: str) -> DeliveryPlan | None:
    """Return the capture's delivery that lacks only its mesh."""
    return _ready.get(root)


def last(root: str) -> Path | None:
    """Return the folder to which the capture was last delivered in this session."""
    return _last.get(root)


def maps_made(root: str, plan: DeliveryPlan) -> None:
    """Add the mesh after the worker's part, if the artist is not busy. Raises Problem as `finish` does."""
    _ready[root] = plan
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or window.modal_operators:
        return
    with bpy.context.temp_override(window=window):
        item = next((item for item in bpy.context.scene.wildcap.captures if captures.root(item) == root), None)
        if bpy.context.mode == 'OBJECT' and item is not None:
            finish(bpy.context, item)


def finish(context, item) -> Path:
    """Add the mesh, give the folder its name and return it. Raises Problem and then keeps the previous delivery."""
    root = captures.root(item)
    plan = _ready.pop(root, None)
    if plan is None or not (plan.staged / PACKING).is_file():
        raise Problem("The maps of this delivery have been deleted.", "Click Deliver again.")
    try:
        files.check(plan.format.suffix)
        if plan.what == "head":
            mesh = captures.require_head(context, item)
            stand.require_eyes(plan, mesh)
        else:
            mesh = delivery_plan.needs(captures.folder(item), plan.what)
        with stand.standing(context, plan, mesh):
            files.export(plan)
        (plan.staged / PACKING).unlink()
        provenance.finish(plan.staged, Blender=bpy.app.version_string)
        delivery_plan.put_in_place(plan)
    except BaseException:
        delivery_plan.discard(plan)
        raise
    _last[root] = plan.target
    problems.show(root, problems.Notice(f"Delivered to {plan.target.name}.", "Open Folder, under Deliver, shows it."))
    return plan.target


def forget() -> None:
    """Discard unfinished deliveries."""
    for plan in _ready.values():
        delivery_plan.discard(plan)
    _ready.clear()
    _last.clear()
