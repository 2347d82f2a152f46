# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: the solver's Python, where captures go, and the sample head."""

import bpy

from .. import preferences
from ..base_panel import FoldedPanel


class WILDCAP_PT_setup(FoldedPanel, bpy.types.Panel):
    bl_label = "Setup"
    bl_order = 90

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.label(text="Solver ready" if preferences.python() else "No solver", icon='CHECKMARK' if preferences.python() else 'X')
        layout.operator("wildcap.use_python", text="Use an Existing Python", icon='FILE_FOLDER')
        layout.prop(preferences.get(), "captures")
        layout.operator("wildcap.open_sample_head", icon='USER')


CLASSES = (WILDCAP_PT_setup,)
