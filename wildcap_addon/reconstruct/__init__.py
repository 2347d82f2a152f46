# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the video to the textured head: starts the worker, brings its result in."""

import bpy

from . import operators, panel

register, unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))
