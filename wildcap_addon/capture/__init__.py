# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which face: a new capture from a video, one that exists, or the sample head."""

import bpy

from . import operators, panel, sample_head, source

register, unregister = bpy.utils.register_classes_factory((*source.CLASSES, *operators.CLASSES, *sample_head.CLASSES, *panel.CLASSES))
