# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: use a Python that has the solver's packages already."""

import os
from pathlib import Path

import bpy

from ...core.capture.messages import Problem
from ...core.worker import environment
from ...core.worker.background import BackgroundTask
from .. import jobs, preferences
from ..base_operator import FileOperator
from . import checking


class WILDCAP_OT_use_python(FileOperator, bpy.types.Operator):
    """Choose a Python, or the folder of a virtual environment, that has the solver's packages"""

    bl_idname = "wildcap.use_python"
    bl_label = "Use an Existing Python"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")

    def work(self, context):
        python = interpreter(Path(bpy.path.abspath(self.filepath)))
        if self.options.is_invoke:
            jobs.start_worker(
                "", "ask", BackgroundTask("setup", lambda task: try_out(task, python)), lambda: checking.accept(python)
            )
        else:  # a script waits for the answer
            checking.judge(python, importing=False)
            preferences.set_python(python)


def try_out(task: BackgroundTask, python: Path) -> None:
    """Raises Problem where a Python lacks something."""
    task.say(0, 1, "asking that Python what it has")
    checking.judge(python, importing=False)


def interpreter(path: Path) -> Path:
    """The Python meant by a file or by a virtual environment's folder. Raises Problem when there is none."""
    for candidate in (path, environment.python_of(path), path / "python.exe"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise Problem(
        f"There is no Python at {path}.", "Choose the python file itself, or the folder of a virtual environment."
    )


CLASSES = (WILDCAP_OT_use_python,)
