# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Base classes of the panels, their width, and the list of a stage's settings."""

from dataclasses import fields

import bpy

from ..core.capture.stages import Stage
from . import captures
from .properties import STAGE_KINDS

NARROW_PX = 260
"""Width below which, at a user interface scale of one, two buttons in a row or a name beside its value are cut."""


class WildcapPanel:
    """Panel of the WildCap tab."""

    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "WildCap"


class FoldedPanel(WildcapPanel):
    """Folded panel under the main one."""

    bl_parent_id = "WILDCAP_PT_main"
    bl_options = {'DEFAULT_CLOSED'}


class CapturePanel(FoldedPanel):
    """Folded panel that needs a capture."""

    @classmethod
    def poll(cls, context):
        return captures.active(context) is not None


def region_width(context) -> int:
    """Return the width of the region in pixels; outside a window, that of a usual sidebar."""
    return context.region.width if context.region else 300


def narrow(context) -> bool:
    """Return whether a row must become a column."""
    return region_width(context) < NARROW_PX * (bpy.context.preferences.system.ui_scale or 1.0)  # 0 without a window


def draw_settings(layout, item, stage: Stage, without: tuple[str, ...] = ()) -> None:
    """Draw a stage's settings under a folded header, except those of `without`, which are drawn elsewhere."""
    header, body = layout.panel(f"wildcap_{stage.name}", default_closed=True)
    header.label(text=stage.label)
    for f in fields(STAGE_KINDS[stage.name]) if body else ():
        if f.name not in without:
            body.prop(getattr(item, stage.name), f.name)
