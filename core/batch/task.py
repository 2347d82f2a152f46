# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One task of one face, run on this machine by a worker in a process of its own: what every kind of batch comes down
to. Standard library only.

Asked for what is done already, it ends well within seconds. The worker ends with the process that asked for it, however
that ends.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from ..capture import switchlight_api
from ..capture.capture import Capture
from ..capture.messages import Cancelled, CancelledError, Done, Failed, Log, Message, Problem
from ..worker.client import THREAD_VARIABLES, Worker
from ..worker.job import read_job, wait_until_free, write_job
from .groups import DELIVER, GROUPS, StageGroup
from .record import Batch, BatchFace
from .state import deliver_settings, has_sheet, is_delivered, waits

ROOT = Path(__file__).resolve().parents[2]
POLL_S = 0.1  # between two looks at the worker


def run_task(
    batch: Batch,
    face: BatchFace,
    group: StageGroup,
    hear: Callable[[Message], None] = lambda message: None,
    cancelled: Callable[[], bool] = lambda: False,
    threads: int | None = None,
) -> Message:
    """Runs a task.

    Parameters
    ----------
    batch, face, group : whose task
    hear : takes what its worker says
    cancelled : whether it is to end
    threads : how many its libraries may start, where other tasks run beside it; None: as many as the worker takes by
        itself

    Returns
    -------
    The final message: Done, Cancelled or Failed.
    """
    environment = {} if threads is None else {name: str(threads) for name in THREAD_VARIABLES}
    began, capture = time.monotonic(), face.capture
    try:
        if waits(batch, face, group):
            raise Problem(
                f"The shadow mask of {face.name} waits to be looked at.",
                f"Open the batch in Blender, or accept it as it is: `python -m core batch accept "
                f"{batch.root} {face.name}`.",
            )
        wait_until_free(capture, lambda text: hear(Log(text)), cancelled)
        job = write_job(
            capture,
            source=face.source if group is GROUPS[0] else "",
            last=group.last,
            settings=face.settings,
            quality=face.quality,
        )
        final = _follow(capture, job, hear, cancelled, environment)
        if group.name == DELIVER and isinstance(final, Done):
            final = _deliver(batch, face, hear, cancelled, environment)
    except CancelledError:
        return Cancelled(group.last)
    except Problem as problem:
        return Failed("", problem.problem, problem.remedy)
    return Done(round(time.monotonic() - began, 2)) if isinstance(final, Done) else final


def _follow(
    capture: Capture,
    job: Path,
    hear: Callable[[Message], None],
    cancelled: Callable[[], bool],
    environment: dict[str, str],
) -> Message:
    """Runs a job to its end and returns its final message. A worker that dies is started once more, for what killed it
    may have been the task beside it."""
    for again in (False, True):
        worker = Worker(Path(sys.executable), ROOT, job, capture.logs / "worker.log", {**environment, **_paid_key(job)})
        final = _listen(worker, hear, cancelled)
        if again or not worker.died:
            return final
        hear(Log(f"{final.problem} It is begun once more."))
        wait_until_free(capture, lambda text: hear(Log(text)), cancelled)
    raise AssertionError


def _listen(worker: Worker, hear: Callable[[Message], None], cancelled: Callable[[], bool]) -> Message:
    """Runs a worker to its end and returns its final message."""
    worker.start()
    try:
        while True:
            for message in worker.poll():
                if not worker.running and isinstance(message, Done | Cancelled | Failed):
                    return message
                hear(message)
            if cancelled():
                worker.cancel()
            time.sleep(POLL_S)
    finally:
        worker.terminate()  # where it was left by an exception


def _paid_key(job: Path) -> dict[str, str]:
    """The key of a paid service that this process was started with, for a job that asks for that service, and for no
    other."""
    key = os.environ.get(switchlight_api.KEY_VARIABLE)
    return (
        {switchlight_api.KEY_VARIABLE: key} if key and read_job(job).settings.delight.delighter == "switchlight" else {}
    )


def _deliver(
    batch: Batch,
    face: BatchFace,
    hear: Callable[[Message], None],
    cancelled: Callable[[], bool],
    environment: dict[str, str],
) -> Message:
    """What comes after the last stage: the delivery, and the contact sheet. Raises Problem."""
    capture, final = face.capture, Done(0.0)
    if batch.deliver is not None and not is_delivered(batch, face):
        final = _follow(
            capture,
            write_job(capture, tool="deliver", settings=deliver_settings(batch, face)),
            hear,
            cancelled,
            environment,
        )
        # job.json is what the stages are judged by in `status` and in Blender
        write_job(capture, last=GROUPS[-1].last, settings=face.settings, quality=face.quality)
    if isinstance(final, Done) and batch.blender and not has_sheet(capture):
        final = _render_sheet(batch.blender, capture, hear, cancelled)
    return final


def _render_sheet(
    blender: str, capture: Capture, hear: Callable[[Message], None], cancelled: Callable[[], bool]
) -> Message:
    """The contact sheet, by a Blender that has the extension. Raises Problem where it cannot be started, or gives
    none."""
    hear(Log("Rendering the contact sheet"))
    capture.logs.mkdir(parents=True, exist_ok=True)
    log = capture.logs / "contact_sheet.log"
    with open(log, "wb") as told:
        try:
            process = subprocess.Popen(
                [blender, "--command", "wildcap", "contact_sheet", str(capture.root)],
                stdin=subprocess.DEVNULL,
                stdout=told,
                stderr=told,
                env=switchlight_api.environment_without_key(),
            )
        except OSError as error:
            raise Problem(
                f"Blender could not be started as {blender} ({error.strerror or error}).",
                "Plan the batch with --blender and its path.",
            ) from error
        try:
            while process.poll() is None:
                if cancelled():
                    return Cancelled(DELIVER)
                time.sleep(POLL_S)
        finally:
            with contextlib.suppress(OSError):
                process.kill()
            process.wait()
    if process.returncode or not has_sheet(capture):
        raise Problem(
            f"Blender rendered no contact sheet of {capture.root.stem}.",
            f"Read {log}; the extension must be installed in that Blender.",
        )
    return Done(0.0)
