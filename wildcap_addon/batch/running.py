# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Process that runs a batch: independent of Blender, stopped by a file, observed through the files it writes."""

import contextlib
import os
import re
import subprocess

import bpy

from ...core.batch.local import ask_to_stop
from ...core.batch.record import Batch
from ...core.capture import switchlight_api
from ...core.capture.files import storage_problem
from ...core.capture.messages import Problem
from .. import batches, captures, incoming, jobs, preferences, problems, status

INTERVAL_S = 0.5
LOG = "run.log"
NICE_VALUE = 10
"""Nice value of a batch, to which that of its workers is added: the artist's own jobs come first."""
SUMMARY = re.compile(r"\d+ faces?: ")
"""Beginning of the last line of a complete run."""
_process: subprocess.Popen | None = None  # of the batch that this session started last
_batch: Batch | None = None
_stopping = False
_worked = ""  # the active capture, if the batch was working on it at the last look


def running() -> bool:
    """Return whether the open batch is running, here or elsewhere."""
    return _process is not None or bool(batches.view().runner)


def started_here() -> bool:
    return _process is not None


def start(batch: Batch, *words: str) -> None:
    """Run `python -m core batch WORDS`. Raises Problem if it cannot start."""
    global _process, _batch, _stopping
    python = preferences.require_python()
    log = batch.root / LOG
    command = [str(python), "-E", "-s", "-B", "-X", "utf8", "-m", "core", "batch", *words]
    try:
        output = open(log, "ab")
    except OSError as error:
        raise storage_problem(error, log) from error
    with output:
        try:
            _process = subprocess.Popen(
                command,
                cwd=jobs.ROOT,
                env=_environment(batch),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                **_apart(),
            )
        except OSError as error:
            raise Problem(
                f"The solver's Python {python} could not be started ({error.strerror or error}).",
                "Install the solver again, or choose another Python.",
            ) from error
    if os.name == "posix":
        with contextlib.suppress(OSError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, _process.pid, NICE_VALUE)
    _batch, _stopping = batch, False
    problems.clear("")


def cancel() -> None:
    """Stop the open batch; finished stages are kept. Raises Problem if its folder cannot be written."""
    global _stopping
    _stopping = True
    _ask_to_stop()


def poll() -> None:
    """Show how the process ended, and repeat a request to stop that came before it listened."""
    global _process, _stopping
    if _process is not None and _process.poll() is not None:
        code, _process = _process.returncode, None
        problem = _problem_of(code)
        if problem is not None:
            problems.show("", problem)
    if _stopping and running():
        with contextlib.suppress(Problem):
            _ask_to_stop()
    elif not running():
        _stopping = False


def _ask_to_stop() -> None:
    try:
        ask_to_stop(batches.current())
    except OSError as error:
        raise storage_problem(error, batches.current()) from error


def _problem_of(code: int) -> Problem | None:
    """Return why a run failed, from the last lines of its log; None for a complete run, whatever stopped its faces."""
    log = _batch.root / LOG
    try:
        problem, remedy = (["", "", *log.read_text(encoding="utf-8", errors="replace").strip().splitlines()])[-2:]
    except OSError:
        problem, remedy = "", ""
    if SUMMARY.match(remedy):
        return None
    if code in (1, 2) and problem:  # the command line's format of a Problem
        return Problem(problem, remedy)
    return Problem(
        f"The batch ended unexpectedly (exit code {code}).",
        f"Start it again: what was finished is kept. If it happens again, read {log}.",
    )


def _environment(batch: Batch) -> dict[str, str]:
    """Return Blender's environment, with the key of a paid service only if a face needs it."""
    paid = any(face.chosen().delight.delighter == "switchlight" for face in batch.faces)
    key = preferences.worker_environment("switchlight" if paid else "")
    return {**switchlight_api.environment_without_key(), **key}


def _apart() -> dict:
    """Return Popen arguments of a process that outlives Blender, its terminal and its session."""
    if os.name != "nt":
        return {"start_new_session": True}
    flags = subprocess.DETACHED_PROCESS | subprocess.BELOW_NORMAL_PRIORITY_CLASS | subprocess.CREATE_NEW_PROCESS_GROUP
    return {"creationflags": flags}


def _tick() -> float:
    global _worked
    try:
        poll()
        has_news = batches.poll()
        root = captures.root(captures.active(bpy.context))
        before, _worked = _worked, root if batches.works_on(root) else ""
        if before and before == root != _worked:
            incoming.bring_in({root: "reconstruct"})
    except Exception as error:  # Blender would drop the timer, and the tab would stand still
        problems.show_error("", error, "listening to the batch")
        has_news = True
    if has_news:
        status.redraw()
    return INTERVAL_S


def register():
    bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)


def unregister():
    """Forget the process; the batch goes on, also when Blender closes."""
    global _process, _batch, _stopping, _worked
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _process, _batch, _stopping, _worked = None, None, False, ""
