# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What all panels share: where they are, how wide, and how a stage's settings are listed."""

from dataclasses import fields

import bpy

from ..core.capture.stages import Stage
from . import captures
from .properties import STAGE_KINDS

NARROW_PX = 260
"""Below this width, at a user interface scale of one, two buttons in a row or a name beside its value are cut"""


class WildcapPanel:
    """Mixin: a panel of the WildCap tab."""

    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "WildCap"


class FoldedPanel(WildcapPanel):
    """Mixin: a room's folded panel under the main one."""

    bl_parent_id = "WILDCAP_PT_main"
    bl_options = {'DEFAULT_CLOSED'}


class CapturePanel(FoldedPanel):
    """Mixin: a folded panel that needs a capture."""

    @classmethod
    def poll(cls, context):
        return captures.active(context) is not None


def region_width(context) -> int:
    """Width of what is drawn into, in pixels; a sidebar's usual one outside of a window."""
    return context.region.width if context.region else 300


def narrow(context) -> bool:
    """Whether what would stand side by side has to stand one below the other."""
    return region_width(context) < NARROW_PX * (bpy.context.preferences.system.ui_scale or 1.0)  # 0 without a window


def draw_settings(layout, item, stage: Stage, without: tuple[str, ...] = ()) -> None:
    """The fields of a stage's settings, in their order, folded away under its name: every one has a good default.

    Parameters
    ----------
    layout : drawn into
    item : the capture's, which holds the values
    stage : of the chain
    without : fields that stand elsewhere
    """
    header, body = layout.panel(f"wildcap_{stage.name}", default_closed=True)
    header.label(text=stage.label)
    group = getattr(item, stage.name)
    for f in fields(STAGE_KINDS[stage.name]) if body else ():
        if f.name not in without:
            body.prop(group, f.name)
