# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A job's stages run over its capture: fresh ones are skipped, successes recorded, failures explained.

Every way a stage can end becomes one message. Tracebacks go to the stage's log and nowhere else.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from .. import __version__
from ..capture import report, tone_choice, unforeseen
from ..capture.capture import Capture
from ..capture.files import storage_problem
from ..capture.freshness import FINISHED, OLDER, has_work
from ..capture.messages import (
    Cancelled,
    CancelledError,
    Done,
    Failed,
    Log,
    Message,
    Problem,
    Reporter,
    StageDone,
    out_of_memory,
)
from ..capture.stages import TOOLS, Stage
from ..settings.setting_paths import check_paths
from ..settings.settings import Settings
from .job import JobRequest, read_job
from .stage_log import at_work


def run_job(
    path: Path, emit: Callable[[Message], None] = lambda message: None, cancelled: Callable[[], bool] = lambda: False
) -> Message:
    """Run the job file `path`, send messages through `emit` and return the final one, which is not sent.

    The capture's lock is released before: whoever reads the final message may start the next job.
    """
    started = time.monotonic()
    stage = ""
    try:
        job = read_job(path)
        with job.capture.locked(lambda text: emit(Log(text)), cancelled):
            if job.tool is not None:
                _check_device(job.settings.device)
                stage = job.tool.name
                _run_tool(job.tool, job, emit, cancelled)
                return Done(round(time.monotonic() - started, 2))
            _take_source(job, emit)
            _check_device(job.settings.device)
            _check_paths(job)
            if job.force:
                job.capture.forget([stage.name for stage in job.chain])
            outdated = []
            for step in job.chain:
                stage = step.name
                if cancelled():
                    raise CancelledError(stage)
                outdated += [step.label] if run_stage(step, job, emit, cancelled) == OLDER else []
            if outdated:
                words = f"Made by older code and kept: {', '.join(outdated)}. "
                emit(Log(f"{words}Run a stage again to have it made by WildCap {__version__}."))
            if tone_choice.find_change(job.capture.read(), job.settings.solve.skin_tone) is not None:
                emit(Log("Another skin tone was chosen since the solve: what is shown and delivered has it."))
    except CancelledError:
        return Cancelled(stage)
    except Exception as error:
        problem = explained(error, stage, path.parent / "logs" / f"{stage or 'worker'}.log")
        return Failed(stage, problem.problem, problem.remedy)
    return Done(round(time.monotonic() - started, 2))


def run_stage(stage: Stage, job: JobRequest, emit: Callable[[Message], None], cancelled: Callable[[], bool]) -> str:
    """Run and record a stage and rebuild the report, unless it is finished, also by older code; return its prior state.

    Raises whatever the stage raises.
    """
    capture, settings = job.capture, job.settings
    state = capture.state(stage, settings)
    record = capture.read()
    if not has_work(capture.root, record, stage):
        return state
    if state in FINISHED:
        finished = record["stages"][stage.name]
        emit(StageDone(stage.name, finished["seconds"], True, finished["figures"]))
        return state
    with at_work(stage, capture, emit, cancelled) as reporter:
        try:
            # from here on outputs may be half new: the record must not vouch for them
            capture.forget([stage.name])
            settings = _with_device(stage, settings, reporter)
            conditions = capture.conditions(stage, settings)
            started = time.monotonic()
            _room(stage).run(capture, settings, reporter)
            empty = stage.only_with and not conditions["inputs"][stage.only_with]
            missing = [] if empty else [name for name in stage.writes if not capture.has(name)]
            if missing:
                raise RuntimeError(f"the stage {stage.name} ended without writing {missing[0]}")
            _add_estimate(stage, capture, settings, reporter)
            seconds = time.monotonic() - started
            capture.finish(stage, conditions, seconds, settings, reporter.figures, __version__, reporter.findings)
            report.write(capture, settings)
        except Problem as problem:
            with contextlib.suppress(OSError, Problem):
                capture.stop(stage.name, problem, reporter.findings)
                report.write(capture, settings)
            raise
    emit(StageDone(stage.name, round(seconds, 2), False, reporter.figures))
    return state


def _add_estimate(stage: Stage, capture: Capture, settings: Settings, reporter: Reporter) -> None:
    """Add the figures of what a stage estimates. Nobody has asked for it, so a failure is a line of the log."""
    tool = next((tool for tool in TOOLS if tool.name == stage.estimates), None)
    if tool is None:
        return
    aside = Reporter(stage.name, cancelled=lambda: _is_cancelled(reporter))
    try:
        _room(tool).run(capture, settings, aside)
    except CancelledError:
        raise
    except Exception as error:
        reporter.log(f"{tool.label} was not estimated: {error}")
        return
    reporter.figures.update(aside.figures)


def _is_cancelled(reporter: Reporter) -> bool:
    """Return whether the user has cancelled what a reporter reports of."""
    try:
        reporter.check()
    except CancelledError:
        return True
    return False


def _run_tool(tool: Stage, job: JobRequest, emit: Callable[[Message], None], cancelled: Callable[[], bool]) -> None:
    """Run one of stages.TOOLS and send its figures. Raises whatever it raises."""
    started = time.monotonic()
    with at_work(tool, job.capture, emit, cancelled) as reporter:
        _room(tool).run(job.capture, _with_device(tool, job.settings, reporter), reporter)
    emit(StageDone(tool.name, round(time.monotonic() - started, 2), False, reporter.figures))


def explained(error: Exception, stage: str, log: Path) -> Problem:
    """Return the problem and remedy behind an exception; the traceback of an unforeseen one goes to `log`."""
    if isinstance(error, Problem):
        return error
    during = f"the stage {stage}" if stage else "the job"
    if out_of_memory(error):
        return Problem(
            f"There was not enough memory for {during}.",
            "Close other programs or choose a lower quality, then run again: finished stages are kept.",
        )
    if isinstance(error, ModuleNotFoundError) and not (error.name or "").startswith(__package__.split(".")[0]):
        return Problem(
            f"The solver's Python has no module named {error.name}, which {during} needs.",
            "Click Install Solver under Setup, or see what `python -m core doctor` says.",
        )
    if isinstance(error, OSError) and error.filename and not isinstance(error, FileNotFoundError):
        return storage_problem(error, Path(os.fsdecode(error.filename)))
    return unforeseen.explain(error, during, log)


def _take_source(job: JobRequest, emit: Callable[[Message], None]) -> None:
    """Record the source if the job begins with the first stage. Raises Problem if it is missing or another one."""
    if job.chain[0].reads:
        return
    capture, first = job.capture, job.chain[0]
    previous = capture.source
    source = Path(job.source) if job.source else previous
    if source is None:
        raise Problem("This capture has no video yet.", "Choose a video, a photograph or a folder of photographs.")
    if not source.exists():
        if job.force or not capture.has(first.writes[0]) or first.name not in capture.read()["stages"]:
            raise Problem(
                f"There is no video or folder at {source}.",
                "Check its name and whether the disk it is on is connected.",
            )
        emit(Log(f"{source} no longer exists; the frames taken from it are used."))
        return
    try:
        if job.force or capture.made_from(source):
            capture.set_source(source)
            return
    except PermissionError as error:
        raise Problem(
            f"{error.filename or source} cannot be read.",
            "Change its permissions (on a Mac: System Settings, Privacy & Security, Files and Folders), or copy it to "
            "a folder that Blender may read.",
        ) from error
    raise Problem(
        f"This capture was made from {previous.name if previous else 'another source'}, not from this {source.name}.",
        f"Choose another capture folder for another video, or run the stage {first.label} again (in a "
        f"terminal: --from {first.name}) to replace everything but the painted masks.",
    )


def _check_paths(job: JobRequest) -> None:
    """Raise Problem, before any stage runs, for missing files in the settings of stages that are not finished.

    The authors' prior works in the UVs of a template that is fitted beside it.
    """
    for step in job.chain:
        try:
            check_paths(job.settings, [step.name])
        except Problem:
            if job.force or job.capture.state(step, job.settings) not in FINISHED:
                raise
    stages = {step.name: step for step in job.chain}
    if (
        job.settings.solve.prior
        and not job.settings.registration.template
        and {"registration", "solve"} <= stages.keys()
        and job.capture.state(stages["solve"], job.settings) not in FINISHED
    ):
        raise Problem(
            "The authors' prior (--prior) works in the UVs of ICT-FaceKit, and no template is to be fitted.",
            "Choose ICT-FaceKit's folder as well (--template), or leave the prior empty to use ours.",
        )


def _check_device(device: str) -> None:
    """Raise Problem for a device that this machine lacks; import torch for GPUs only."""
    if device not in ("cpu", "auto"):
        import torch

        if not (torch.cuda.is_available() if device == "cuda" else torch.backends.mps.is_available()):
            raise Problem(
                f"This machine has no device {device} that torch can use.",
                "Choose auto, or see what `python -m core doctor` says.",
            )


def _with_device(step: Stage, settings: Settings, reporter: Reporter) -> Settings:
    """Return the settings of a step on a device with the proven device for "auto"."""
    if settings.device != "auto" or not step.on_device:
        return settings
    proof = importlib.import_module("..stages.solve.device", __package__).prove()
    reporter.log(f"Computing on {proof.device}: {proof.reason}")
    return replace(settings, device=proof.device)


def _room(step: Stage):
    """Import the module of a stage or tool, which may take seconds."""
    return importlib.import_module("." + step.module.split(".", 1)[1], __package__.rpartition(".")[0])
