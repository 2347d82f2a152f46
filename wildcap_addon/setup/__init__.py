# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""First steps: the solver's Python, and the sample head that needs none."""

import bpy

from . import operators, panel

register, unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))
