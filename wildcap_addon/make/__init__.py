# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One click from a video to a relit head: the whole chain in one job, and its results in the scene."""

import bpy

from .. import incoming, terminal
from . import command, operators, results

RESULTS = incoming.Results(results.take, results.has_news)
_register, _unregister = bpy.utils.register_classes_factory(operators.CLASSES)


def register():
    _register()
    incoming.on_results.append(RESULTS)
    terminal.commands.extend(command.COMMANDS)


def unregister():
    terminal.forget(command.COMMANDS)
    incoming.on_results.remove(RESULTS)
    results.forget()
    _unregister()
