# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One click from a video to a relit head: the whole chain in one job, and what Blender does as its results come."""

import bpy

from .. import jobs, terminal
from . import command, operators, results

RESULTS = jobs.Results(results.take, results.has_news)
_register, _unregister = bpy.utils.register_classes_factory(operators.CLASSES)


def register():
    _register()
    jobs.on_results.append(RESULTS)
    terminal.commands.extend(command.COMMANDS)


def unregister():
    terminal.forget(command.COMMANDS)
    jobs.on_results.remove(RESULTS)
    results.forget()
    _unregister()
