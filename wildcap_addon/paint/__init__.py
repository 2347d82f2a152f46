# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks and layers, painted on the head or on a flat sheet of its texture."""

import bpy

from .. import incoming, jobs
from . import files, layer_operators, layer_panel, layer_update, operators, panel, session

RESULTS = incoming.Results(layer_update.take, layer_update.waits)
_register, _unregister = bpy.utils.register_classes_factory(
    (*operators.CLASSES, *layer_operators.CLASSES, *panel.CLASSES, *layer_panel.CLASSES)
)


def register():
    _register()
    files.register()
    jobs.before_start.append(session.save)
    session.after_layers.append(layer_update.after_painting)
    incoming.on_results.append(RESULTS)


def unregister():
    incoming.on_results.remove(RESULTS)
    session.after_layers.remove(layer_update.after_painting)
    layer_update.forget()
    jobs.before_start.remove(session.save)
    files.unregister()
    _unregister()
