# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that deliver the head, the artist's own mesh or the scan: the worker writes the maps, Blender the mesh."""

from contextlib import ExitStack

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import delivery_plan
from ...core.capture.delivery_plan import DeliveryPlan
from ...core.capture.messages import Problem
from ...core.worker import read_only
from .. import captures, jobs, properties
from ..base_operator import BaseOperator, Dialog
from . import files, stand, waiting


class WILDCAP_OT_deliver(Dialog, bpy.types.Operator):
    """Write the mesh with its maps as another program wants them, in a folder of their own"""

    bl_idname = "wildcap.deliver"
    bl_label = "Deliver"

    @classmethod
    def poll(cls, context):
        return cls.in_object_mode(context) and jobs.can_start(cls, context)

    def tell(self) -> tuple[str, ...]:
        """Return what is written where, what is replaced, and what the format drops."""
        plan = planned(bpy.context)
        lines = [iface_("{} with its maps, for {}, goes to {}").format(plan.mesh, plan.preset.title, plan.target)]
        if plan.target.exists():
            lines.append(
                iface_(
                    "The delivery that is there is replaced once the new one is complete; files that you added stay."
                )
            )
        obj = captures.head(bpy.context, captures.require(bpy.context))
        left_out = stand.left_behind(obj, plan.what, plan.format.suffix)
        return (*lines, *plan.format.drops, *left_out, plan.preset.hint)

    def work(self, context):
        item = captures.require(context)
        plan, root, obj = planned(context), captures.root(item), captures.head(context, item)
        delivery_plan.check_target(plan)
        stand.require_eyes(plan, obj)
        settings = {**properties.job_settings(item)["deliver"], "roughness": roughness(obj), "whole": False}
        until_it_ends = ExitStack()
        at = until_it_ends.enter_context(read_only.stand_in(captures.folder(item), settings["folder"]))
        try:
            jobs.start_tool(
                item,
                "deliver",
                "deliver",
                then=lambda: waiting.maps_made(root, plan),
                at=at,
                ended=until_it_ends.close,
                deliver=settings,
            )
        except BaseException:
            until_it_ends.close()
            raise
        item.deliver.replace = False  # it was meant for this delivery


class WILDCAP_OT_finish_delivery(BaseOperator, bpy.types.Operator):
    """The maps are written: add the mesh, and give the folder its name"""

    bl_idname = "wildcap.finish_delivery"
    bl_label = "Finish Delivery"

    @classmethod
    def poll(cls, context):
        ready = cls.with_capture(context) and waiting.ready(captures.root(captures.active(context))) is not None
        return cls.in_object_mode(context) and cls.allowed(ready, "No delivery waits for its mesh: click Deliver")

    def work(self, context):
        folder = waiting.finish(context, captures.require(context))
        self.report({'INFO'}, iface_("Delivered to {}").format(folder))


class WILDCAP_OT_open_delivery(BaseOperator, bpy.types.Operator):
    """Show the folder of the last delivery in the system's file manager"""

    bl_idname = "wildcap.open_delivery"
    bl_label = "Open Folder"

    @classmethod
    def poll(cls, context):
        delivered = cls.with_capture(context) and waiting.last(captures.root(captures.active(context))) is not None
        return cls.allowed(delivered, "Nothing has been delivered since Blender was started")

    def work(self, context):
        folder = waiting.last(captures.root(captures.require(context)))
        if not folder.is_dir():
            raise Problem(f"The delivery {folder.name} has been deleted or moved.", "Click Deliver to write it again.")
        bpy.ops.wm.path_open(filepath=str(folder))


def planned(context) -> DeliveryPlan:
    """Return the delivery that the settings ask for. Raises Problem if it cannot be made."""
    item = captures.require(context)
    capture = captures.folder(item)
    plan = delivery_plan.plan(capture, properties.settings(item).deliver)
    delivery_plan.needs(capture, plan.what)
    if plan.what == "head":
        captures.require_head(context, item)
    files.check(plan.format.suffix)
    return plan


def roughness(head) -> int:
    """Return the roughness of the head's skin material in percent, 45 if it has none."""
    materials = [slot.material for slot in head.material_slots] if head is not None else []
    for material in materials:
        for node in material.node_tree.nodes if material is not None and material.node_tree is not None else ():
            if node.type == 'GROUP' and "Roughness" in node.inputs and not node.inputs["Roughness"].is_linked:
                return round(100 * min(1.0, max(0.0, node.inputs["Roughness"].default_value)))
    return 45


CLASSES = (WILDCAP_OT_deliver, WILDCAP_OT_finish_delivery, WILDCAP_OT_open_delivery)
