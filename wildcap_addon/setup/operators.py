# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that chooses a Python with the solver's packages."""

import os
from pathlib import Path

import bpy

from ...core.capture.messages import Problem
from ...core.worker import environment
from .. import asking, jobs, preferences
from ..base_operator import FileOperator
from . import checking


class WILDCAP_OT_use_python(FileOperator, bpy.types.Operator):
    """Choose a Python, or the folder of a virtual environment, that has the solver's packages."""

    bl_idname = "wildcap.use_python"
    bl_label = "Use an Existing Python"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")

    def work(self, context):
        python = interpreter(Path(bpy.path.abspath(self.filepath)))
        if self.options.is_invoke:
            try_out(python)
        else:  # a script waits for the answer
            checking.judge(python, importing=False)
            preferences.set_python(python)


def try_out(python: Path) -> None:
    """Check a Python in the background, and make it the solver's if it has the packages."""
    asking.run(
        "asking that Python what it has",
        lambda task: checking.judge(python, importing=False),
        lambda _: checking.accept(python),
    )


def interpreter(path: Path) -> Path:
    """Return the Python of a file's or a virtual environment's path. Raises Problem if there is none."""
    for candidate in (path, environment.python_of(path), path / "python.exe"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise Problem(
        f"There is no Python at {path}.", "Choose the python file itself, or the folder of a virtual environment."
    )


CLASSES = (WILDCAP_OT_use_python,)
