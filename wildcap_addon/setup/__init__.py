# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment of the solver: installation or an existing Python, checks, and the self-test."""

import bpy

from . import checking, install, operators, panel, report, self_test

_register, _unregister = bpy.utils.register_classes_factory(
    (*install.CLASSES, *operators.CLASSES, *report.CLASSES, *self_test.CLASSES, *panel.CLASSES)
)


def register():
    _register()
    checking.register()


def unregister():
    checking.unregister()
    _unregister()
