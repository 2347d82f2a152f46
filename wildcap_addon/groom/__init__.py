# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair: brows, lashes and beard as hair curves on the head, over the albedo of the skin below them."""

import bpy

from .. import head
from . import operators, panel

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    head.COMPLETERS.append(operators.keep_up)


def unregister():
    head.COMPLETERS.remove(operators.keep_up)
    _unregister()
