# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: save a report about a problem, to be sent by whoever wants to. Nothing is sent here."""

import time
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture.messages import Problem
from ...core.worker import problem_report
from ...core.worker.background import BackgroundTask
from .. import captures, jobs, preferences, problems
from ..base_operator import FileOperator


class WILDCAP_OT_save_report(FileOperator, bpy.types.Operator):
    """Save a zip with logs, versions and settings, to send with a question: no pictures, no names, no paths of yours.
    Nothing is sent"""

    bl_idname = "wildcap.save_report"
    bl_label = "Save Report"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')
    filter_glob: bpy.props.StringProperty(default="*.zip", options={'HIDDEN'})

    @classmethod
    def poll(cls, context):
        return cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")

    def invoke(self, context, event):
        self.filepath = str(Path.home() / f"wildcap_report_{time.strftime('%Y-%m-%d_%H%M')}.zip")
        return super().invoke(context, event)

    def work(self, context):
        if not self.filepath:
            raise Problem("No file was chosen for the report.", "Click Save Report and say where it goes.")
        target, python = Path(bpy.path.abspath(self.filepath)), preferences.python()
        item = captures.active(context)
        capture = captures.folder(item) if item is not None else None
        blender = bpy.app.version_string
        task = BackgroundTask("setup", lambda task: save_report(task, target, python, capture, blender))
        jobs.start_worker("", "ask", task, lambda: tell(task.result))


def save_report(task: BackgroundTask, target: Path, python, capture, blender: str) -> Path:
    """Writes the report in the background.

    Parameters
    ----------
    task : says how far it is
    target : the zip; .zip is added where it lacks
    python : of the worker; None where there is none
    capture : told of; None where there is none
    blender : its version

    Returns
    -------
    The zip that was written.

    Raises
    ------
    Problem
        Where the file is there already, or cannot be written.
    """
    task.say(0, 1, "writing the report")
    return problem_report.write(target, jobs.ROOT, python, capture, Blender=blender)


def tell(target: Path) -> None:
    problems.show("", problems.Notice(iface_("The report is {}.").format(target), "Look into it before you send it."))


CLASSES = (WILDCAP_OT_save_report,)
