# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that runs a batch: started here, apart from Blender, which may close meanwhile; asked to stop by a file;
listened to through what it writes."""

import contextlib
import os
import re
import subprocess

import bpy

from ...core.batch.local import ask_to_stop
from ...core.batch.record import Batch
from ...core.capture import switchlight_api, unforeseen
from ...core.capture.files import storage_problem
from ...core.capture.messages import Problem
from .. import batches, captures, incoming, jobs, preferences, problems, status

INTERVAL_S = 0.5
LOG = "run.log"
NICE_VALUE = 10
"""Nice value of a batch, to which that of its workers is added: what the artist waits for comes first, a job of
Blender's own among it."""
SUMMARY = re.compile(r"\d+ faces?: ")
"""How the last line of a run that went to its end begins."""
_process: subprocess.Popen | None = None  # of the batch that was started last, in this session
_batch: Batch | None = None
_stopping = False
_worked = ""  # the active capture, where the batch had it in hand a moment ago


def running() -> bool:
    """Whether the open batch is being run, here or elsewhere."""
    return _process is not None or bool(batches.view().runner)


def started_here() -> bool:
    return _process is not None


def start(batch: Batch, *words: str) -> None:
    """Runs `python -m core batch WORDS`. Raises Problem when it cannot be started."""
    global _process, _batch, _stopping
    python = preferences.require_python()
    log = batch.root / LOG
    command = [str(python), "-E", "-s", "-B", "-X", "utf8", "-m", "core", "batch", *words]
    try:
        told = open(log, "ab")
    except OSError as error:
        raise storage_problem(error, log) from error
    with told:
        try:
            _process = subprocess.Popen(
                command,
                cwd=jobs.ROOT,
                env=_environment(batch),
                stdin=subprocess.DEVNULL,
                stdout=told,
                stderr=told,
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
    """Asks who runs the open batch to stop; what was finished is kept. Raises Problem where its folder cannot be
    written."""
    global _stopping
    _stopping = True
    _ask_to_stop()


def poll() -> None:
    """Tells how the process ended that was started here, and asks one that had not begun to listen once more to
    stop."""
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
    """Why a run did not go to its end, by the last lines that it wrote; None where it did: what stopped single faces
    stands in them."""
    log = _batch.root / LOG
    try:
        problem, remedy = (["", "", *log.read_text(encoding="utf-8", errors="replace").strip().splitlines()])[-2:]
    except OSError:
        problem, remedy = "", ""
    if SUMMARY.match(remedy):
        return None
    if code in (1, 2) and problem:  # as the command line tells a Problem
        return Problem(problem, remedy)
    return Problem(
        f"The batch ended unexpectedly (exit code {code}).",
        f"Start it again: what was finished is kept. If it happens again, read {log}.",
    )


def _environment(batch: Batch) -> dict[str, str]:
    """Blender's own, with the key of a paid service for those alone who need it."""
    paid = next((face for face in batch.faces if face.chosen().delight.delighter == "switchlight"), None)
    return {
        **switchlight_api.environment_without_key(),
        **preferences.worker_environment("switchlight" if paid else ""),
    }


def _apart() -> dict:
    """Popen arguments: a process that does not end with Blender, its terminal or its session."""
    if os.name == "nt":
        return {
            "creationflags": subprocess.DETACHED_PROCESS
            | subprocess.BELOW_NORMAL_PRIORITY_CLASS
            | subprocess.CREATE_NEW_PROCESS_GROUP
        }
    return {"start_new_session": True}


def _tick() -> float:
    global _worked
    try:
        poll()
        changed = batches.poll()
        root = captures.root(captures.active(bpy.context))
        before, _worked = _worked, root if batches.works_on(root) else ""
        if before and before == root != _worked:
            incoming.bring_in({root: "reconstruct"})
    except Exception as error:  # nobody is above a timer: without this, Blender would drop it and the tab stand still
        problems.show("", unforeseen.explain(error, "listening to the batch"))
        changed = True
    if changed:
        status.redraw()
    return INTERVAL_S


def register():
    bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)


def unregister():
    """Also when Blender closes: the batch goes on."""
    global _process, _batch, _stopping, _worked
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _process, _batch, _stopping, _worked = None, None, False, ""
