# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relight: the maps in a material, under a light, in a picture."""

import bpy

from .. import terminal, tones
from . import command, compare, operators, output, panel, tone

_register, _unregister = bpy.utils.register_classes_factory((*operators.CLASSES, *compare.CLASSES, *panel.CLASSES))


def register():
    _register()
    output.register()
    terminal.commands.extend(command.COMMANDS)
    tones.viewers.append(tone.wear)


def unregister():
    tones.viewers.remove(tone.wear)
    terminal.forget(command.COMMANDS)
    output.unregister()
    _unregister()
