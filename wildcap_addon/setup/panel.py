# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: the first steps, until a solver answers; from then on the same is in the extension's preferences."""

import bpy

from .. import preferences
from ..base_panel import WildcapPanel


class WILDCAP_PT_setup(WildcapPanel, bpy.types.Panel):
    bl_label = "Setup"
    bl_order = 90
    bl_parent_id = "WILDCAP_PT_main"

    @classmethod
    def poll(cls, context):
        return preferences.python() is None

    def draw(self, context):
        preferences.draw_solver(self.layout, preferences.get())
        self.layout.label(text="Masks, materials and renders work without it")


CLASSES = (WILDCAP_PT_setup,)
