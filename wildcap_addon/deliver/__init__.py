# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Deliver: the head, or what else was made of it, for other programs."""

import bpy

from .. import terminal
from . import command, operators, panel, waiting

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *panel.CLASSES))


def register():
    _register()
    terminal.commands.extend(command.COMMANDS)


def unregister():
    terminal.forget(command.COMMANDS)
    waiting.forget()
    _unregister()
