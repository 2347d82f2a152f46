# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The running jobs, one per capture, and the solver's installation: started by an operator, polled by a timer, stopped
when Blender closes.

One worker runs at a time, for each takes all cores; jobs of other captures wait in line. Run-time state only, nothing
of it reaches the .blend. A job belongs to its capture: opening another .blend, a new scene or an undo past its start
changes nothing; disabling the add-on or closing Blender ends it, and what was finished is kept.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture import messages, stages, unforeseen
from ..core.capture.capture import Capture
from ..core.capture.messages import Problem
from ..core.settings.settings import Settings
from ..core.worker.background import BackgroundTask
from ..core.worker.client import Worker
from ..core.worker.job import read_job, write_job
from . import batches, captures, incoming, preferences, problems, properties, status, timings

INTERVAL_S = 0.2  # between two looks at the workers' messages
# the folder that holds core/, where the worker starts; nothing is written there
ROOT = Path(__file__).resolve().parent.parent


@dataclass
class Job:
    """A worker at a capture, and the last thing it said. `previews` counts the preview pictures so far."""

    # 'make', 'reconstruct', 'solve', 'install', 'test', or 'ask' for what is found out or tidied up in seconds
    goal: str
    worker: Worker | BackgroundTask
    then: Callable[[], None] | None = None  # called when it ended well
    ended: Callable[[], None] | None = None  # called before that, however it ended
    well: bool = False
    # called with the capture's folder when a preview is new, and when the job has ended
    on_preview: Callable[[str], None] | None = None
    # called with the name of each stage that is done, or was done before
    on_stage: Callable[[str], object] | None = None
    planned: tuple[str, ...] = ()  # the stages that it goes through
    settings: Settings | None = None
    waiting: bool = False  # in line behind another capture's job
    figures: dict = field(default_factory=dict)  # of the stage that ended last
    progress: messages.Progress | None = None
    stage: str = ""
    previews: int = 0
    log: list[str] = field(default_factory=list)


before_start: list[Callable[[], None]] = []
"""What rooms do before a worker reads a capture: the mask that is being painted is saved. May raise Problem, and then
nothing starts."""
_jobs: dict[str, Job] = {}  # capture folder -> its job; '' -> the installation


def of(root: str) -> Job | None:
    """The capture's running job."""
    return _jobs.get(root)


def elsewhere(root: str) -> list[tuple[str, Job]]:
    """The jobs of other captures than this one, which may be in another scene or .blend: (capture folder, job)."""
    return [(other, job) for other, job in _jobs.items() if other not in (root, "")]


def can_start(operator, context) -> bool:
    """Whether there is a capture that no job and no batch works on; says in the tooltip of a greyed-out button why
    not."""
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
    **shared,
) -> Job:
    """Starts stages at a capture. Raises Problem when it cannot.

    Parameters
    ----------
    item : the capture's
    goal, then, on_stage : as Job has them
    first, last : the stages to begin with (None: what is not fresh) and to end with (None: the last)
    shared : settings for this once
    """
    capture = captures.folder(item)
    job = _launch(
        item,
        goal,
        capture,
        then,
        lambda: write_job(capture, first=first, last=last, settings={**properties.job_settings(item), **shared}),
    )
    job.on_stage = on_stage
    job.planned = stages.NAMES[
        stages.NAMES.index(first or stages.NAMES[0]) : stages.NAMES.index(last or stages.NAMES[-1]) + 1
    ]
    return job


def start_tool(
    item,
    tool: str,
    goal: str = "tool",
    *,
    then: Callable[[], None] | None = None,
    ended: Callable[[], None] | None = None,
    at: Capture | None = None,
    **shared,
) -> Job:
    """Starts one of core.capture.stages.TOOLS at a capture. Raises Problem when it cannot.

    Parameters
    ----------
    item : the capture's
    tool : its name
    goal, then, ended : as Job has them
    at : a capture that stands in for this one
    shared : settings for this once
    """
    capture = at or captures.folder(item)
    job = _launch(
        item,
        goal,
        capture,
        then,
        lambda: write_job(capture, tool=tool, settings={**properties.job_settings(item), **shared}),
    )
    job.ended = ended
    return job


def _launch(item, goal: str, capture: Capture, then: Callable[[], None] | None, write: Callable[[], Path]) -> Job:
    """A job at `capture`, which is the item's or stands in for it; `write` writes its job.json."""
    root = captures.root(item)
    if root in _jobs:
        raise Problem("This capture is being worked on already.", "Wait for it, or click Cancel.")
    python = preferences.require_python()
    for prepare in before_start:
        prepare()
    path = write()
    settings = read_job(path).settings
    job = start_worker(
        root,
        goal,
        Worker(
            python, ROOT, path, capture.logs / "worker.log", preferences.worker_environment(settings.delight.delighter)
        ),
        then,
    )
    job.settings = settings
    return job


def start_worker(root: str, goal: str, worker: Worker | BackgroundTask, then: Callable[[], None] | None = None) -> Job:
    """Starts a worker, or puts it in line behind the one that runs, and listens to it. Raises Problem when it cannot.

    Parameters
    ----------
    root : the capture's folder; "" for what is of no capture, which never waits
    goal, worker, then : as Job has them
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
    """Asks the capture's job ('': the installation) to stop; it does so within two seconds. One that waits leaves the
    line."""
    if root in _jobs and _jobs[root].waiting:
        _leave(root)
    elif root in _jobs:
        _jobs[root].worker.cancel()


def poll() -> bool:
    """Takes in what the workers said. True while one is running. Makes no data-blocks; tests call it in place of the
    timer."""
    for root, job in list(_jobs.items()):
        if job.waiting:
            continue
        for message in job.worker.poll():
            _hear(root, job, message)
        if not job.worker.running:
            _leave(root)
            if job.on_preview is not None:
                job.on_preview(root)
            _finish(root, job)
    if not _busy():
        _start_next()
    return bool(_jobs)


def _busy() -> bool:
    return any(root and not job.waiting for root, job in _jobs.items())


def _start_next() -> None:
    """The first job in line; one that cannot start says so in its capture's tab and makes room for the next."""
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


def _finish(root: str, job: Job) -> None:
    """What follows a job that ended well, now that another one can begin."""
    if job.well and job.then is not None:
        try:
            job.then()
        except Problem as problem:
            problems.show(root, problem)


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
            job.progress, job.figures = None, message.figures
            if job.on_stage is not None:
                job.on_stage(message.stage)
            if not message.skipped:
                timings.record_stage(message.stage, message.seconds)
            if (
                message.stage == "solve"
                and not message.skipped
                and job.settings is not None
                and not any("Going on after" in line for line in job.log)
            ):
                timings.record(job.settings, message.seconds)
        case messages.Done():
            job.well = True
        case messages.Failed():
            problems.show(root, Problem(message.problem, message.remedy))
        case messages.Cancelled():
            problems.show(root, problems.Notice("Cancelled.", "What was finished is kept; click again to continue."))


def _tick() -> float | None:
    before, shown = dict(_jobs), _shown()
    try:
        poll()
        ended = {root: job.goal for root, job in before.items() if root not in _jobs}
        if ended or incoming.waits():
            incoming.bring_in(ended)
    except Exception as error:  # nobody is above a timer: without this, Blender would drop it and the tab stand still
        problems.show("", error if isinstance(error, Problem) else unforeseen.explain(error, "listening to the solver"))
    if shown != _shown():  # a redraw of the tab takes time from the worker, and from whoever paints
        status.redraw()
    return INTERVAL_S if _jobs or incoming.waits() else None


def _shown() -> list[tuple]:
    """All that the tab shows of the jobs."""
    return [(root, job.waiting, job.progress, job.previews) for root, job in _jobs.items()]


def eta(job: Job) -> str:
    """What is left of the stage, and of the whole where the next ones' times are known from before, in words; '' when
    unknown."""
    seconds = job.progress.eta_s if job.progress else None
    words = (
        ""
        if seconds is None
        else iface_("{} s left").format(f"{seconds:.0f}")
        if seconds < 90
        else iface_("{} min left").format(f"{seconds / 60:.0f}")
    )
    later = job.planned[job.planned.index(job.stage) + 1 :] if job.stage in job.planned else ()
    ahead = timings.of_stages(later) if later and seconds is not None else None
    return (
        words
        if ahead is None
        else iface_("{}, about {} min in all").format(words, max(1, round((seconds + ahead) / 60)))
    )


def stage_label(job: Job) -> str:
    if job.waiting:
        return "Waiting"
    return (
        stages.LABELS[job.stage]
        if job.stage in stages.LABELS
        else {"install": "Installing", "ask": "Looking"}.get(job.goal, "Starting")
    )


def register():
    pass


def unregister():
    """Also when Blender closes: no worker outlives it (and if Blender dies, the end of its stdin stops the worker)."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    for job in [job for job in _jobs.values() if not job.waiting]:
        job.worker.terminate()
    for root in list(_jobs):
        _leave(root)
