# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which face: a new capture from a video, or one that exists."""

import bpy

from . import operators, panel

register, unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))
