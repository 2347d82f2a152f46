# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The log of a stage: everything that is printed while it runs, and the traceback if it fails."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable

from ..capture import ownership
from ..capture.capture import Capture
from ..capture.files import storage_problem
from ..capture.messages import Log, Message, Problem, Progress, Reporter
from ..capture.stages import Stage


@contextlib.contextmanager
def at_work(step: Stage, capture: Capture, emit: Callable[[Message], None], cancelled: Callable[[], bool]):
    """Yield a stage's or tool's reporter, and send output and traceback to its log. Raises Problem without inputs."""
    missing = [name for name in step.reads if not capture.has(name)]
    if missing:
        raise Problem(
            f"{step.label} needs {missing[0]}, which this capture does not have.",
            "Run the stages before it first: click Reconstruct.",
        )
    emit(Progress(step.name, 0, 1, "Starting"))
    kept_before = ownership.kept_files(capture.root)
    with _log_of(capture, step) as log:
        try:
            yield Reporter(step.name, _logging(emit, log), cancelled)
        except Problem as problem:
            with contextlib.suppress(OSError):  # the disk may be full
                traceback.print_exception(problem, file=log)
            raise
        finally:
            for kept in sorted(ownership.kept_files(capture.root) - kept_before):
                emit(Log(f"A file that was changed since WildCap wrote it made way for a new one: it is now {kept}."))


@contextlib.contextmanager
def _log_of(capture: Capture, stage: Stage):
    """Open logs/STAGE.log and redirect stdout and stderr to it, also those of C++ libraries."""
    path = capture.logs / f"{stage.name}.log"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        log = open(path, "w", encoding="utf-8", buffering=1)
    except OSError as error:
        raise storage_problem(error, path) from error
    originals = [os.dup(1), os.dup(2)]
    try:
        for descriptor in (1, 2):
            os.dup2(log.fileno(), descriptor)
        yield log
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        for descriptor, original in zip((1, 2), originals, strict=True):
            os.dup2(original, descriptor)
            os.close(original)
        with contextlib.suppress(OSError):
            log.close()


def _logging(emit: Callable[[Message], None], log) -> Callable[[Message], None]:
    """Return `emit` with a copy of the stage's log lines in its log."""

    def both(message: Message) -> None:
        if isinstance(message, Log):
            with contextlib.suppress(OSError):
                print(time.strftime("%H:%M:%S"), message.text, file=log)
        emit(message)

    return both
