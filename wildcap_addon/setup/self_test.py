# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: the sample head solved again on this machine, in a folder that Blender takes away when it closes; captures
are not touched."""

import shutil
import tempfile
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.worker import self_test
from ...core.worker.client import Worker
from .. import jobs, preferences, problems
from ..base_operator import BaseOperator


class WILDCAP_OT_self_test(BaseOperator, bpy.types.Operator):
    """Solve the sample head again on this machine, compare it with what it should be, and say how long that took. Your
    captures are not touched"""

    bl_idname = "wildcap.self_test"
    bl_label = "Self-Test"

    @classmethod
    def poll(cls, context):
        return (
            cls.allowed(preferences.python() is not None, "There is no solver to test yet: click Install Solver")
            and cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")
            and cls.allowed(
                not jobs.elsewhere(""), "The solver is at work: wait for it, so that the seconds mean something"
            )
        )

    def work(self, context):
        preferences.get().tested = ""
        folder = Path(tempfile.mkdtemp(prefix="self_test_", dir=bpy.app.tempdir or None))
        capture = self_test.prepare(folder)
        job = jobs.start_worker("", "test", Worker(preferences.python(), jobs.ROOT, capture.job, folder / "worker.log"))
        job.then, job.ended = lambda: tell(job.figures), lambda: shutil.rmtree(folder, ignore_errors=True)


def tell(figures: dict) -> None:
    """Shows how the test went, and keeps it in the preferences."""
    said = iface_("The solver works: {} dB where {} or more were expected, in {} s.").format(
        *(f"{figures[name]:.1f}" for name in ("score_db", "expected_db")), f"{figures['seconds']:.0f}"
    )
    preferences.get().tested = said
    problems.show(
        "",
        problems.Notice(
            said, "The sample head was solved again on this machine, and compared with the one that is shipped."
        ),
    )


CLASSES = (WILDCAP_OT_self_test,)
