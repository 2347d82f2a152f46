# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many faces at once: a batch that outlives Blender, and the walk through the masks that wait."""

import bpy

from . import operators, panel, running

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    running.register()


def unregister():
    running.unregister()
    _unregister()
