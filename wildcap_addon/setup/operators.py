# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the first steps: install the solver into an environment of its own, use an existing Python, remove it."""

import os
import sys
from pathlib import Path

import bpy

from ...core.messages import Problem
from ...core.worker import environment
from .. import jobs, preferences
from ..base_operator import BaseOperator

REQUIREMENTS = jobs.ROOT / "requirements"
SIZE = "up to 3 GB to download and 7 GB on disk" if sys.platform == "linux" else "about 1 GB to download and 2 GB on disk"
"""PyPI's torch for Linux brings CUDA; without it the environment measures 1.6 GB"""


class WILDCAP_OT_install_solver(BaseOperator, bpy.types.Operator):
    """Download the solver's packages from PyPI into a folder of their own; Blender's Python stays as it is"""

    bl_idname = "wildcap.install_solver"
    bl_label = "Install Solver"

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being installed already: wait for it, or click Cancel")

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event, title="Install the Solver?", confirm_text="Install",
                                                     message=f"PyTorch and other packages from PyPI, {SIZE}, into {preferences.environment_folder()}")

    def work(self, context):
        if not bpy.app.online_access:
            where = "" if bpy.app.online_access_override else " (Preferences, System, Network)"
            raise Problem("Blender is set to work offline.", f"Allow online access{where}, or use a Python that has the packages already.")
        folder = preferences.environment_folder()
        installation = environment.Installation(folder, REQUIREMENTS, folder.with_name(f"{folder.name}.log"))
        jobs.begin("", "install", installation, lambda: preferences.set_python(environment.python_of(folder)))


class WILDCAP_OT_use_python(BaseOperator, bpy.types.Operator):
    """Choose a Python, or the folder of a virtual environment, that has the solver's packages"""

    bl_idname = "wildcap.use_python"
    bl_label = "Use an Existing Python"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context):
        python = interpreter(Path(bpy.path.abspath(self.filepath)))
        problems = environment.verify(python, REQUIREMENTS)
        if problems:
            raise Problem(f"{python} cannot run the solver. {' '.join(problems[:3])}",
                          f"Install what {REQUIREMENTS / 'worker.txt'} lists, then nets.txt beside it with --no-deps; or click Install Solver.")
        preferences.set_python(python)


class WILDCAP_OT_remove_solver(BaseOperator, bpy.types.Operator):
    """Delete the folder that Install Solver made; captures stay"""

    bl_idname = "wildcap.remove_solver"
    bl_label = "Remove Solver"

    @classmethod
    def poll(cls, context):
        return (cls.allowed(jobs.of("") is None, "The solver is being installed: wait for it, or click Cancel")
                and cls.allowed(preferences.environment_folder().is_dir(), "Nothing was installed here that could be removed"))

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event, title="Remove the Solver?", message=f"Deletes {preferences.environment_folder()}")

    def work(self, context):
        folder = preferences.environment_folder()
        environment.remove(folder)
        if not preferences.python():
            preferences.set_python(None)


def interpreter(path: Path) -> Path:
    """The Python meant by a file or by a virtual environment's folder. Raises Problem when there is none."""
    for candidate in (path, environment.python_of(path), path / "python.exe"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise Problem(f"There is no Python at {path}.", "Choose the python file itself, or the folder of a virtual environment.")


CLASSES = (WILDCAP_OT_install_solver, WILDCAP_OT_use_python, WILDCAP_OT_remove_solver)
