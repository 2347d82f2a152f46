# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the face: a new capture from a video, an existing one, or the sample head."""

import bpy

from . import deleting, operators, panel, sample_head, source, strip

_register, _unregister = bpy.utils.register_classes_factory(
    (*source.CLASSES, *operators.CLASSES, *deleting.CLASSES, *sample_head.CLASSES, *panel.CLASSES)
)


def register():
    _register()
    strip.register()


def unregister():
    strip.unregister()
    _unregister()
