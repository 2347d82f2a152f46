# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: use a Python that has the solver's packages already; and what looks at the chosen one again when Blender starts."""

import os
from pathlib import Path

import bpy

from ...core.messages import Problem
from ...core.worker import environment
from ...core.worker.background import Task
from .. import jobs, preferences, problems, status
from ..base_operator import BaseOperator
from .install import REQUIREMENTS

LOOK_S = 2.0
_checks: list[Task] = []  # the look at the Python that is under way, if any


class WILDCAP_OT_use_python(BaseOperator, bpy.types.Operator):
    """Choose a Python, or the folder of a virtual environment, that has the solver's packages"""

    bl_idname = "wildcap.use_python"
    bl_label = "Use an Existing Python"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context):
        python = interpreter(Path(bpy.path.abspath(self.filepath)))
        if self.options.is_invoke:  # every package is loaded once, which takes its time
            task = Task("setup", lambda task: judge(task, python))
            jobs.begin("", "ask", task, lambda: preferences.set_python(python, task.result))
        else:
            refuse(python, environment.verify(python, REQUIREMENTS))
            preferences.set_python(python)


def judge(task: Task, python: Path) -> str:
    """The device that a Python computes on. Raises Problem where it cannot run the solver."""
    task.say(0, 1, "trying that Python")
    found = environment.survey(python, REQUIREMENTS, importing=True)
    refuse(python, environment.judge(found, REQUIREMENTS))
    return found["device"]


def refuse(python: Path, faults: list[str]) -> None:
    if faults:
        raise Problem(f"{python} cannot run the solver. {' '.join(faults[:3])}",
                      f"Install what {REQUIREMENTS / 'worker.txt'} lists, then nets.txt beside it with --no-deps; or click Install Solver.")


def interpreter(path: Path) -> Path:
    """The Python meant by a file or by a virtual environment's folder. Raises Problem when there is none."""
    for candidate in (path, environment.python_of(path), path / "python.exe"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise Problem(f"There is no Python at {path}.", "Choose the python file itself, or the folder of a virtual environment.")


def check_again() -> float | None:
    """A timer: whether the solver's Python still answers, asked once in a thread after Blender has started. One that does not is set aside."""
    if not _checks:
        python = preferences.python()
        if python is None:
            return None
        _checks.append(Task("setup", lambda task: refuse(python, environment.verify(python, REQUIREMENTS))))
        _checks[0].start()
    for message in _checks[0].poll():
        if hasattr(message, "problem"):
            preferences.set_aside(preferences.python())
            problems.show("", Problem(message.problem, message.remedy))
            status.redraw()
    return 0.5 if _checks[0].running else None


def register():
    bpy.app.timers.register(check_again, first_interval=LOOK_S, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(check_again):
        bpy.app.timers.unregister(check_again)
    _checks.clear()


CLASSES = (WILDCAP_OT_use_python,)
