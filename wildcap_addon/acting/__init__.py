# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head that can act: the lips and lids of the registered head opened, eyes and mouth behind them, ARKit's face units
as shape keys."""

import bpy

from .. import head
from . import gaze, mesh, operators, panel
from .close_up import building

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    head.FOLLOWERS.append(mesh.renewed)
    head.COMPLETERS.extend((mesh.open_filmed_eyes, gaze.keep_up, building.keep_up))


def unregister():
    head.COMPLETERS.remove(mesh.open_filmed_eyes)
    head.COMPLETERS.remove(gaze.keep_up)
    head.COMPLETERS.remove(building.keep_up)
    head.FOLLOWERS.remove(mesh.renewed)
    _unregister()
