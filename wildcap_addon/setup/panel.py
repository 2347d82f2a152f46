# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel: the solver's Python, and where captures go."""

import bpy

from .. import preferences
from ..base_panel import FoldedPanel
from .operators import SIZE


class WILDCAP_PT_setup(FoldedPanel, bpy.types.Panel):
    bl_label = "Setup"
    bl_order = 90

    def draw(self, context):
        layout = self.layout
        ready = preferences.python() is not None
        layout.label(text="The solver is ready" if ready else "There is no solver", icon='CHECKMARK' if ready else 'X')
        column = layout.column(align=True)
        column.operator("wildcap.install_solver", icon='IMPORT')
        column.label(text=SIZE.capitalize())
        column.operator("wildcap.use_python", icon='FILE_FOLDER')
        column.operator("wildcap.remove_solver", icon='TRASH')
        column = layout.column()
        column.prop(preferences.get(), "environment", text="Solver")
        column.prop(preferences.get(), "captures", text="Captures")


CLASSES = (WILDCAP_PT_setup,)
