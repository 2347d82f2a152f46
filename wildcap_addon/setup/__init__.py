# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""First steps: the solver, in an environment of its own or in an existing Python."""

import bpy

from . import operators, panel

register, unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))
