# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Running jobs, one per capture, and the solver's installation: started by operators, polled by a timer.

One worker runs at a time, as each uses all cores; jobs of other captures wait in line. Run-time state only. A job
belongs to its capture: another .blend, a new scene or an undo past its start do not affect it; disabling the add-on or
closing Blender ends it, and finished stages are kept.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture import messages, stages
from ..core.capture.capture import Capture
from ..core.capture.messages import Problem
from ..core.settings.settings import Settings
from ..core.worker.background import BackgroundTask
from ..core.worker.client import Worker
from ..core.worker.job import read_job, write_job
from . import batches, captures, incoming, preferences, problems, properties, status, timings, tones

INTERVAL_S = 0.2  # between two looks at the workers' messages
# the folder that holds core/, where the worker starts; nothing is written there
ROOT = Path(__file__).resolve().parent.parent


@dataclass
class Job:
    """Worker at a capture, and its last messages."""

    # 'make', 'reconstruct', 'solve', 'tool', 'deliver', 'install', 'test', or 'ask' for what takes seconds
    goal: str
    worker: Worker | BackgroundTask
    then: Callable[[], None] | None = None  # called after success
    ended: Callable[[], None] | None = None  # called before that, after any end
    well: bool = False
    # called with the capture's folder after each new preview, and after the end
    on_preview: Callable[[str], None] | None = None
    # called with the name of each stage that is done or was already
    on_stage: Callable[[str], object] | None = None
    planned: tuple[str, ...] = ()  # its stages
    settings: Settings | None = None
    waiting: bool = False  # in line behind another capture's job
    figures: dict = field(default_factory=dict)  # of the stage that ended last
    progress: messages.Progress | None = None
    stage: str = ""
    previews: int = 0  # number of preview pictures so far
    log: list[str] = field(default_factory=list)


before_start: list[Callable[[], None]] = []
"""Functions of rooms to call before a worker reads a capture, such as saving a mask; a Problem prevents the start."""
_jobs: dict[str, Job] = {}  # capture folder -> its job; '' -> the installation


def of(root: str) -> Job | None:
    """Return the capture's job."""
    return _jobs.get(root)


def elsewhere(root: str) -> list[tuple[str, Job]]:
    """Return (capture folder, job) of other captures, which may be in another scene or .blend."""
    return [(other, job) for other, job in _jobs.items() if other not in (root, "")]


def can_start(operator, context) -> bool:
    """Return whether there is a capture without a job; otherwise the disabled button explains why. For `poll`."""
    root = captures.root(captures.active(context))
    return (
        operator.with_capture(context)
        and operator.allowed(of(root) is None, "This capture is being worked on: wait for it, or click Cancel")
        and operator.allowed(
            not batches.works_on(root),
            "This capture is being worked on by a batch or another Blender: wait for it, or cancel it there",
        )
    )


def start(
    item,
    goal: str,
    *,
    first: str | None = None,
    last: str | None = None,
    then: Callable[[], None] | None = None,
    on_stage: Callable[[str], object] | None = None,
    **once,
) -> Job:
    """Start stages at a capture: from `first` (None: the first that is not fresh) to `last` (None: the last one).

    `once` holds settings for this job alone. Raises Problem if it cannot start.
    """
    job = _launch(item, goal, captures.folder(item), then, once, first=first, last=last)
    job.on_stage = on_stage
    names = stages.NAMES
    job.planned = names[names.index(first or names[0]) : names.index(last or names[-1]) + 1]
    return job


def start_tool(
    item,
    tool: str,
    goal: str = "tool",
    *,
    then: Callable[[], None] | None = None,
    ended: Callable[[], None] | None = None,
    at: Capture | None = None,
    **once,
) -> Job:
    """Start one of core.capture.stages.TOOLS at a capture, or at `at` in its place; otherwise like `start`."""
    job = _launch(item, goal, at or captures.folder(item), then, once, tool=tool)
    job.ended = ended
    return job


def _launch(item, goal: str, capture: Capture, then: Callable[[], None] | None, once: dict, **span) -> Job:
    root = captures.root(item)
    if root in _jobs:
        raise Problem("This capture is being worked on already.", "Wait for it, or click Cancel.")
    python = preferences.require_python()
    for prepare in before_start:
        prepare()
    tones.take_in(item)
    path = write_job(capture, settings={**properties.job_settings(item), **once}, **span)
    settings = read_job(path).settings
    environment = preferences.worker_environment(settings.delight.delighter)
    worker = Worker(python, ROOT, path, capture.logs / "worker.log", environment)
    job = start_worker(root, goal, worker, then)
    job.settings = settings
    return job


def start_worker(root: str, goal: str, worker: Worker | BackgroundTask, then: Callable[[], None] | None = None) -> Job:
    """Start a worker, or put it in line behind the running one. Raises Problem if it cannot start.

    `root` is the capture's folder, or '' for work on no capture, which never waits.
    """
    waiting = root != "" and _busy()
    if not waiting:
        worker.start()
    problems.clear(root)
    _jobs[root] = Job(goal, worker, then, waiting=waiting)
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)
    return _jobs[root]


def cancel(root: str) -> None:
    """Stop the capture's job ('': the installation) within two seconds; one that waits leaves the line."""
    if root in _jobs and _jobs[root].waiting:
        _leave(root)
    elif root in _jobs:
        _jobs[root].worker.cancel()


def poll() -> bool:
    """Process the workers' messages, and return whether jobs are left. Makes no data-blocks.

    Tests call it in place of the timer.
    """
    for root, job in list(_jobs.items()):
        if job.waiting:
            continue
        for message in job.worker.poll():
            _hear(root, job, message)
        if not job.worker.running:
            _leave(root)
            if job.on_preview is not None:
                job.on_preview(root)
            if job.well and job.then is not None:
                try:
                    job.then()
                except Problem as problem:
                    problems.show(root, problem)
    if not _busy():
        _start_next()
    return bool(_jobs)


def _busy() -> bool:
    return any(root and not job.waiting for root, job in _jobs.items())


def _start_next() -> None:
    """Start the first job in line; one that fails shows its problem, and the next is tried."""
    for root, job in [(root, job) for root, job in _jobs.items() if job.waiting]:
        try:
            job.worker.start()
        except Problem as problem:
            problems.show(root, problem)
            _leave(root)
            continue
        job.waiting = False
        return


def _leave(root: str) -> None:
    job = _jobs.pop(root)
    if job.ended is not None:
        job.ended()


def _hear(root: str, job: Job, message: messages.Message) -> None:
    match message:
        case messages.Progress():
            job.progress, job.stage = message, message.stage
        case messages.Preview():
            job.previews += 1
            if job.on_preview is not None:
                job.on_preview(root)
        case messages.Log():
            job.log = [*job.log[-99:], message.text]
        case messages.StageDone():
            _note_stage(job, message)
        case messages.Done():
            job.well = True
        case messages.Failed():
            problems.show(root, Problem(message.problem, message.remedy))
        case messages.Cancelled():
            problems.show(root, problems.Notice("Cancelled.", "What was finished is kept; click again to continue."))


def _note_stage(job: Job, message: messages.StageDone) -> None:
    job.progress, job.figures = None, message.figures
    if job.on_stage is not None:
        job.on_stage(message.stage)
    if message.skipped:
        return
    timings.record_stage(message.stage, message.seconds)
    resumed = any("Going on after" in line for line in job.log)
    if message.stage == "solve" and job.settings is not None and not resumed:
        timings.record(job.settings, message.seconds)


def _tick() -> float | None:
    before, display = dict(_jobs), _shown()
    try:
        poll()
        ended = {root: job.goal for root, job in before.items() if root not in _jobs}
        if ended or incoming.waits():
            incoming.bring_in(ended)
    except Exception as error:  # Blender would drop the timer, and the tab would stand still
        problems.show_error("", error, "listening to the solver")
    if display != _shown():  # a redraw takes time from the worker, and from an artist who paints
        status.redraw()
    return INTERVAL_S if _jobs or incoming.waits() else None


def _shown() -> list[tuple]:
    """Return all that the tab shows of the jobs."""
    return [(root, job.waiting, job.progress, job.previews) for root, job in _jobs.items()]


def eta(job: Job) -> str:
    """Describe the time left of the stage, and in all if the later stages' times are known; '' if unknown."""
    seconds = job.progress.eta_s if job.progress else None
    if seconds is None:
        return ""
    words = (
        iface_("{} s left").format(f"{seconds:.0f}")
        if seconds < 90
        else iface_("{} min left").format(f"{seconds / 60:.0f}")
    )
    later = job.planned[job.planned.index(job.stage) + 1 :] if job.stage in job.planned else ()
    ahead = timings.of_stages(later) if later else None
    if ahead is None:
        return words
    return iface_("{}, about {} min in all").format(words, max(1, round((seconds + ahead) / 60)))


def stage_label(job: Job) -> str:
    if job.waiting:
        return "Waiting"
    goal = {"install": "Installing", "ask": "Looking"}.get(job.goal, "Starting")
    return stages.LABELS.get(job.stage, goal)


def register():
    pass


def unregister():
    """End all workers, also when Blender closes; if Blender crashes, the end of its stdin stops the worker."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    for job in [job for job in _jobs.values() if not job.waiting]:
        job.worker.terminate()
    for root in list(_jobs):
        _leave(root)
