# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that saves a report about a problem, for the artist to send. Nothing is sent here."""

import time
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture.messages import Problem
from ...core.worker import problem_report
from .. import asking, captures, jobs, preferences, problems
from ..base_operator import FileOperator


class WILDCAP_OT_save_report(FileOperator, bpy.types.Operator):
    """Save a zip with logs, versions and settings, without pictures, names and paths, to send with a question.

    Nothing is sent.
    """

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
            raise Problem("No file was chosen for the report.", "Click Save Report and choose a file.")
        target, python = Path(bpy.path.abspath(self.filepath)), preferences.python()
        item, blender = captures.active(context), bpy.app.version_string
        capture = captures.folder(item) if item is not None else None
        asking.run(
            "writing the report",
            lambda task: problem_report.write(target, jobs.ROOT, python, capture, Blender=blender),
            _show,
        )


def _show(target: Path) -> None:
    text = iface_("The report is {}.").format(target)
    problems.show("", problems.Notice(text, "Read it before you send it."))


CLASSES = (WILDCAP_OT_save_report,)
