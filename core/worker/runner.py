# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a job's stages over its capture: skips what is fresh, records what ended well, explains what did not.

Every way a stage can end becomes one message. A traceback goes to the stage's log and nowhere else.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

from .. import __version__
from ..contract import report, slimmed, unforeseen
from ..contract.capture import Capture
from ..contract.files import storage_problem
from ..contract.freshness import FINISHED, OLDER
from ..contract.messages import (
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
from ..contract.portable_paths import convert_settings, read_portable
from ..contract.setting_paths import check_paths
from ..contract.settings import Settings, from_json
from ..contract.stages import Stage
from .job import JobRequest, read_job
from .stage_log import at_work


def run_job(
    path: Path, emit: Callable[[Message], None] = lambda message: None, cancelled: Callable[[], bool] = lambda: False
) -> Message:
    """Runs the job file `path`, sends what happens through `emit` and returns the final message, which is not sent.

    The capture's lock is given back before the return, so whoever reads the final message may start the next job.
    """
    started = time.monotonic()
    stage = ""
    try:
        job = read_job(path)
        with job.capture.locked(lambda text: emit(Log(text)), cancelled):
            if job.tool is None:
                _take_source(job, emit)
            _check_device(job.settings.device)
            if job.tool is None:
                _check_paths(job)
            _check_slimmed(job)
            if job.tool is not None:
                stage = job.tool.name
                _run_tool(job.tool, job, emit, cancelled)
                return Done(round(time.monotonic() - started, 2))
            if job.force:
                job.capture.forget([stage.name for stage in job.chain])
            kept = []
            for step in job.chain:
                stage = step.name
                if cancelled():
                    raise CancelledError(stage)
                kept += [step.label] if run_stage(step, job, emit, cancelled) == OLDER else []
            if kept:
                emit(
                    Log(
                        f"Made by older code and kept: {', '.join(kept)}. Run a stage again to have it made by "
                        f"WildCap {__version__}."
                    )
                )
    except CancelledError:
        return Cancelled(stage)
    except Exception as error:
        problem = explained(error, stage, path.parent / "logs" / f"{stage or 'worker'}.log")
        return Failed(stage, problem.problem, problem.remedy)
    return Done(round(time.monotonic() - started, 2))


def run_stage(stage: Stage, job: JobRequest, emit: Callable[[Message], None], cancelled: Callable[[], bool]) -> str:
    """Runs one stage, records it, and rebuilds the report, unless the stage is finished: done, or made by older code,
    which is not ours to replace. Raises whatever the stage raises.

    Parameters
    ----------
    stage : to run
    job : with the capture and the settings
    emit : takes the messages
    cancelled : whether it is to end

    Returns
    -------
    The state that the stage was found in.
    """
    capture, settings = job.capture, job.settings
    state = capture.state(stage, settings)
    if state in FINISHED:
        finished = capture.read()["stages"][stage.name]
        emit(StageDone(stage.name, finished["seconds"], True, finished["figures"]))
        return state
    with at_work(stage, capture, emit, cancelled) as reporter:
        try:
            _bring_back(stage, job, emit, cancelled)
            # Outputs may be half new from here on: until the end, nobody may take them for the recorded result.
            capture.forget([stage.name])
            settings = _with_device(stage, settings, reporter)
            conditions = capture.conditions(stage, settings)
            started = time.monotonic()
            _make(stage, capture, settings, reporter)
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


def _run_tool(tool: Stage, job: JobRequest, emit: Callable[[Message], None], cancelled: Callable[[], bool]) -> None:
    """Runs one of stages.TOOLS and sends its figures. Raises whatever it raises."""
    started = time.monotonic()
    with at_work(tool, job.capture, emit, cancelled) as reporter:
        _bring_back(tool, job, emit, cancelled)
        _room(tool).run(job.capture, _with_device(tool, job.settings, reporter), reporter)
    emit(StageDone(tool.name, round(time.monotonic() - started, 2), False, reporter.figures))


def _bring_back(step: Stage, job: JobRequest, emit: Callable[[Message], None], cancelled: Callable[[], bool]) -> None:
    """Has made again what a stage or tool reads and was slimmed away, with the settings that it was made with. Where
    the same comes out, it is as if it had never gone; where not, for the code is another or what it is made from has
    changed, it counts as new. Raises whatever the stages raise."""
    capture = job.capture
    for stage in slimmed.makers(capture.read(), [step]):
        entry = capture.read()["stages"][stage.name]
        if not slimmed.is_back(capture.root, entry):  # as where a worker was killed just before it could say so
            emit(Log(f"{stage.label}: slimmed away, and made again for {step.label}."))
            with at_work(stage, capture, emit, cancelled) as reporter:
                settings = _with_device(stage, _as_before(stage, entry, job), reporter)
                conditions, started = capture.conditions(stage, settings), time.monotonic()
                _make(stage, capture, settings, reporter)
                seconds = time.monotonic() - started
            emit(StageDone(stage.name, round(seconds, 2), False, reporter.figures))
            if not slimmed.is_back(capture.root, entry):
                capture.finish(stage, conditions, seconds, settings, reporter.figures, __version__, reporter.findings)
                emit(
                    Log(
                        f"{stage.label}: not what they were before, for other code made them, or from other inputs. "
                        "What was made from them is out of date."
                    )
                )
                continue
        capture.drop_hashes(stage)


def _as_before(stage: Stage, entry: dict, job: JobRequest) -> Settings:
    """The settings that a stage was last run with, by its entry in capture.json, on the same device where this machine
    has it."""
    then = convert_settings({stage.name: entry["settings"]}, lambda path: str(read_portable(path, job.capture.root)))[
        stage.name
    ]
    known = asdict(getattr(job.settings, stage.name))
    settings = from_json(
        {stage.name: {name: value for name, value in then.items() if name in known}, "seed": entry["seed"]},
        job.settings,
    )
    with contextlib.suppress(Problem):
        there = from_json({"device": entry["device"]}, settings)
        _check_device(there.device)
        return there
    return settings


def _make(stage: Stage, capture: Capture, settings: Settings, reporter: Reporter) -> None:
    """Runs a stage's room, and sees to it that all that it writes is there."""
    _room(stage).run(capture, settings, reporter)
    lost = [name for name in stage.writes if not capture.holds(name)]
    if lost:
        raise RuntimeError(f"the stage {stage.name} ended without writing {lost[0]}")


def _check_slimmed(job: JobRequest) -> None:
    """Raises Problem, before anything is changed, where the job needs what was slimmed away and the source that it is
    made from is gone."""
    capture = job.capture
    record = capture.read()
    if slimmed.hashes_of(record):
        chain = (job.tool,) if job.tool else job.chain
        first = next(
            (
                i
                for i, step in enumerate(chain)
                if job.tool or job.force or capture.state(step, job.settings) not in FINISHED
            ),
            len(chain),
        )
        if not all(stage.reads for stage in slimmed.makers(record, chain[first:])):
            try:
                capture.require_source()
            except Problem as problem:
                if not job.tool:
                    capture.stop(chain[first].name, problem)
                raise


def explained(error: Exception, stage: str, log: Path) -> Problem:
    """What any exception means to the user: a problem and a remedy, both whole sentences. The traceback of one that
    nobody foresaw goes to `log`."""
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
    """Records the source where the job begins with the stage that reads it. Raises Problem when there is none, or
    another one than before."""
    if job.chain[0].reads:
        return
    capture, first = job.capture, job.chain[0]
    known = capture.source
    source = Path(job.source) if job.source else known
    if source is None:
        raise Problem("This capture has no video yet.", "Choose a video or a folder of photographs.")
    if not source.exists():
        if job.force or not capture.has(first.writes[0]) or first.name not in capture.read()["stages"]:
            raise Problem(
                f"There is no video or folder at {source}.",
                "Check its name and whether the disk it is on is connected.",
            )
        emit(Log(f"{source} is not there any more; what was taken from it is used."))
        return
    try:
        if job.force or capture.made_from(source):
            capture.set_source(source)
            return
    except PermissionError as error:
        raise Problem(
            f"{error.filename or source} cannot be read.",
            "Change its permissions (on a Mac: System Settings, Privacy & Security, Files and Folders), or "
            "copy it to a folder that Blender may read.",
        ) from error
    raise Problem(
        f"This capture was made from {known.name if known else 'another source'}, not from this {source.name}.",
        f"Choose another capture folder for another video, or run the stage {first.label} again (in a "
        f"terminal: --from {first.name}) to replace everything but the painted masks.",
    )


def _check_paths(job: JobRequest) -> None:
    """Raises Problem, before any stage runs, for what the settings name and a later stage would miss. What a finished
    stage was made from may have gone since."""
    for step in job.chain:
        try:
            check_paths(job.settings, [step.name])
        except Problem:
            if job.force or job.capture.state(step, job.settings) not in FINISHED:
                raise


def _check_device(device: str) -> None:
    """Raises Problem for a device that this machine does not have. torch is imported for GPUs only."""
    if device not in ("cpu", "auto"):
        import torch

        if not (torch.cuda.is_available() if device == "cuda" else torch.backends.mps.is_available()):
            raise Problem(
                f"This machine has no device {device} that torch can use.",
                "Choose auto, or see what `python -m core doctor` says.",
            )


def _with_device(step: Stage, settings: Settings, reporter: Reporter) -> Settings:
    """The settings with the device that was proven in the place of auto, where a step computes on one; why that one
    goes to its log."""
    if settings.device != "auto" or not step.on_device:
        return settings
    proof = importlib.import_module("..solve.device", __package__).prove()
    reporter.log(f"Computing on {proof.device}: {proof.reason}")
    return replace(settings, device=proof.device)


def _room(step: Stage):
    """The module that does a stage's or tool's work; importing it may take seconds."""
    return importlib.import_module("." + step.module.split(".", 1)[1], __package__.rpartition(".")[0])
