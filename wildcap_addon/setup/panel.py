# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of the solver, also shown in the extension's preferences."""

import bpy

from .. import preferences, problems
from ..base_panel import FoldedPanel, region_width


class WILDCAP_PT_setup(FoldedPanel, bpy.types.Panel):
    bl_label = "Setup"
    bl_order = 90

    def draw(self, context):
        preferences.draw_solver(self.layout, preferences.get())
        if preferences.python() is None:
            problems.draw_text(self.layout, "Masks, materials and renders work without it.", region_width(context))


CLASSES = (WILDCAP_PT_setup,)
