# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that solves the sample head on this machine, in a temporary folder."""

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
    """Solve the sample head on this machine, compare the result with the shipped one, and measure the time.

    Your captures are not changed.
    """

    bl_idname = "wildcap.self_test"
    bl_label = "Self-Test"

    @classmethod
    def poll(cls, context):
        return (
            cls.allowed(preferences.python() is not None, "There is no solver to test yet: click Install Solver")
            and cls.allowed(jobs.of("") is None, "The solver is being set up: wait for it, or click Cancel")
            and cls.allowed(
                not jobs.elsewhere(""), "The solver is at work: wait for it, or the measured time would be wrong"
            )
        )

    def work(self, context):
        preferences.get().tested = ""
        folder = Path(tempfile.mkdtemp(prefix="self_test_", dir=bpy.app.tempdir or None))
        capture = self_test.prepare(folder)
        job = jobs.start_worker("", "test", Worker(preferences.python(), jobs.ROOT, capture.job, folder / "worker.log"))
        job.then, job.ended = lambda: tell(job.figures), lambda: shutil.rmtree(folder, ignore_errors=True)


def tell(figures: dict) -> None:
    """Show the result of the test, and store it in the preferences."""
    text = iface_("The solver works: {} dB where {} or more were expected, in {} s.").format(
        *(f"{figures[name]:.1f}" for name in ("score_db", "expected_db")), f"{figures['seconds']:.0f}"
    )
    preferences.get().tested = text
    remedy = "The sample head was solved again on this machine, and compared with the shipped one."
    problems.show("", problems.Notice(text, remedy))


CLASSES = (WILDCAP_OT_self_test,)
