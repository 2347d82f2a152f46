# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in the background: how it ends, and that what was cancelled is over."""

import contextlib
import os
import sys
import threading
import time

import pytest

from core.capture.messages import Cancelled, CancelledError, Done, Problem
from core.worker.background import BackgroundTask
from tests.fixtures.tiny_packages import follow, run

SLEEP = [sys.executable, "-c", "import time; time.sleep(60)"]


def test_a_task_ends_with_its_problem_or_at_its_limit():
    def refuse(task):
        raise Problem("It cannot be.", "Let it be.")

    for work, problem in ((refuse, "It cannot be."), (lambda task: 1 / 0, "An error inside WildCap stopped")):
        (final,) = run(BackgroundTask("try", work))
        assert final.problem.startswith(problem)
    task = BackgroundTask("slow", lambda task: task.run(SLEEP, limit_s=0.2))
    assert isinstance(run(task)[-1], Done) and task.result[0] != 0


def test_a_command_is_heard_line_by_line_and_its_last_error_kept():
    lines = []
    code = "print('Error: one'); print('é'); print('error two'); print('end'); raise SystemExit(3)"
    task = BackgroundTask("say", lambda task: task.run([sys.executable, "-X", "utf8", "-c", code], lines.append))
    assert isinstance(run(task)[-1], Done) and task.result == (3, "error two")
    assert lines == ["Error: one\n", "é\n", "error two\n", "end\n"]


@pytest.mark.skipif(os.name == "nt", reason="Windows ends the command alone")
def test_a_cancel_ends_what_the_command_has_started(tmp_path):
    """venv runs pip's installer as a process of its own, which must not go on in a folder that the next installation
    begins with."""
    late = tmp_path / "late"
    child = (
        f"import time, pathlib; pathlib.Path({str(tmp_path / 'begun')!r}).touch(); time.sleep(0.7); "
        f"pathlib.Path({str(late)!r}).touch()"
    )
    starter = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    task = BackgroundTask("venv", lambda task: task.run([sys.executable, "-c", starter]))
    task.start()
    while not (tmp_path / "begun").exists():
        time.sleep(0.02)
    task.cancel()
    assert follow(task, 2) == [Cancelled("venv")]
    time.sleep(1)
    assert not late.exists()


def test_what_was_cancelled_does_nothing_more():
    """Another task may work in the same folder meanwhile."""
    going, done = threading.Event(), []

    def work(task: BackgroundTask) -> None:
        going.wait()
        for step in (lambda: task.say(0, 1, "more"), lambda: task.run(SLEEP)):
            with contextlib.suppress(CancelledError):
                step()
                done.append(step)

    task = BackgroundTask("slow", work)
    task.start()
    task.cancel()
    assert follow(task, 2) == [Cancelled("slow")]
    going.set()
    task._thread.join(5)
    assert not done and task._process is None
