# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the first steps: choose the solver's Python; open the sample head."""

import os
import shutil
import subprocess
from pathlib import Path

import bpy

from ...core.capture import Capture, replacing_folder, storage_problem
from ...core.messages import Problem
from .. import captures, preferences
from ..base_operator import BaseOperator

SAMPLE = Path(__file__).resolve().parents[2] / "core" / "assets" / "sample_head"
PACKAGES = ("torch", "numpy", "scipy", "cv2", "OpenImageIO", "pycolmap", "trimesh", "skimage", "av", "safetensors", "mediapipe")


class WILDCAP_OT_use_python(BaseOperator, bpy.types.Operator):
    """Choose a Python, or the folder of a virtual environment, that has the solver's packages"""

    bl_idname = "wildcap.use_python"
    bl_label = "Set Up Solver"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context):
        python = interpreter(Path(bpy.path.abspath(self.filepath)))
        check(python)
        preferences.get().python = str(python)
        context.preferences.is_dirty = True


class WILDCAP_OT_open_sample_head(BaseOperator, bpy.types.Operator):
    """Copy the finished sample head to your captures and show it; needs no solver"""

    bl_idname = "wildcap.open_sample_head"
    bl_label = "Open Sample Head"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        captures.add(context, copy_sample(preferences.captures_folder()).root)
        if context.mode != 'OBJECT':
            bpy.ops.object.mode_set(mode='OBJECT')
        bpy.ops.wildcap.bring_in_head()
        bpy.ops.wildcap.assemble_material()


def interpreter(path: Path) -> Path:
    """The Python meant by a file or by a virtual environment's folder. Raises Problem when there is none."""
    for candidate in (path, path / "bin" / "python", path / "Scripts" / "python.exe", path / "python.exe"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise Problem(f"There is no Python at {path}.", "Choose the python file itself, or the folder of a virtual environment.")


def check(python: Path) -> None:
    """Raises Problem unless the Python is new enough and has every package; imports none of them, which would take long."""
    code = ("import sys, importlib.util as u; "
            f"print(sys.version_info >= (3, 11), *(n for n in {PACKAGES!r} if u.find_spec(n) is None))")
    try:
        result = subprocess.run([str(python), "-E", "-s", "-c", code], capture_output=True, text=True, timeout=30)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Problem(f"{python} cannot be run ({error}).", "Choose another Python.") from error
    if result.returncode or not result.stdout.split():
        raise Problem(f"{python} is not a working Python.", "Choose another Python.")
    new_enough, *missing = result.stdout.split()
    if new_enough != "True":
        raise Problem(f"{python} is older than Python 3.11.", "Choose a newer one.")
    if missing:
        raise Problem(f"{python} lacks {', '.join(missing)}.",
                      f"Install them with: {python} -m pip install -r requirements/worker.txt, then the same with --no-deps for requirements/nets.txt.")


def copy_sample(folder: Path) -> Capture:
    """A writable copy of the shipped sample head in `folder`; one that is there already is kept with the artist's work in it."""
    if not (SAMPLE / "head.obj").is_file():
        raise Problem("The sample head is missing from this installation.", "Install the extension's zip again.")
    capture = Capture(folder / "sample_head.wildcap")
    if not capture.head.is_file():
        try:
            with replacing_folder(capture.root) as temporary:
                shutil.copytree(SAMPLE, temporary, dirs_exist_ok=True, copy_function=shutil.copyfile)
        except shutil.Error as error:
            raise storage_problem(OSError(*error.args[0][0][2:]), capture.root) from error
    return capture


CLASSES = (WILDCAP_OT_use_python, WILDCAP_OT_open_sample_head)
