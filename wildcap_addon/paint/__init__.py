# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks, painted on the head or on a flat sheet of its texture."""

import bpy

from .. import jobs
from . import files, operators, panel, session

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    files.register()
    jobs.before_start.append(session.save)


def unregister():
    jobs.before_start.remove(session.save)
    files.unregister()
    _unregister()
