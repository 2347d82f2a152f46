# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face units: the head's lips and lids cut open, eyes and mouth behind them, ARKit's units as shape keys."""

import bpy

from .. import head
from . import gaze, mesh, operators, panel
from .close_up import building

COMPLETERS = (mesh.open_filmed_eyes, gaze.keep_up, building.keep_up)
_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    head.FOLLOWERS.append(mesh.follow)
    head.COMPLETERS.extend(COMPLETERS)


def unregister():
    for completer in COMPLETERS:
        head.COMPLETERS.remove(completer)
    head.FOLLOWERS.remove(mesh.follow)
    _unregister()
