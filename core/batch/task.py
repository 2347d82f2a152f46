# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One task of one face, run by a worker process on this machine; every kind of batch uses it. Standard library only.

A task that is already done ends within seconds. The worker ends with the process that started it.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from ..capture import switchlight_api
from ..capture.capture import Capture
from ..capture.messages import FINAL, Cancelled, CancelledError, Done, Failed, Log, Message, Problem
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
    """Run a task and return its final message; `hear` takes the others.

    `threads` limits the libraries' threads where other tasks run beside this one.
    """
    environment = {} if threads is None else {name: str(threads) for name in THREAD_VARIABLES}
    began, capture = time.monotonic(), face.capture
    follow = partial(_follow, capture, hear, cancelled, environment)
    try:
        if waits(batch, face, group):
            raise Problem(
                f"The shadow mask of {face.name} waits for review.",
                f"Open the batch in Blender, or accept the mask: `python -m core batch accept "
                f"{batch.root} {face.name}`.",
            )
        wait_until_free(capture, lambda text: hear(Log(text)), cancelled)
        source = face.source if group is GROUPS[0] else ""
        final = follow(write_job(capture, source=source, last=group.last, settings=face.wanted(), quality=face.quality))
        if group.name == DELIVER and isinstance(final, Done) and batch.deliver is not None:
            if not is_delivered(batch, face):
                final = follow(write_job(capture, tool="deliver", settings=deliver_settings(batch, face)))
                # `status` and Blender judge the stages by job.json
                write_job(capture, last=group.last, settings=face.wanted(), quality=face.quality)
        if group.name == DELIVER and isinstance(final, Done) and batch.blender and not has_sheet(capture):
            final = _render_sheet(batch.blender, capture, hear, cancelled)
    except CancelledError:
        return Cancelled(group.last)
    except Problem as problem:
        return Failed("", problem.problem, problem.remedy)
    return Done(round(time.monotonic() - began, 2)) if isinstance(final, Done) else final


def _follow(
    capture: Capture,
    hear: Callable[[Message], None],
    cancelled: Callable[[], bool],
    environment: dict[str, str],
    job: Path,
) -> Message:
    """Run a job and return its final message; restart once a worker that dies, perhaps for want of memory."""
    final, died = _run_worker(capture, hear, cancelled, environment, job)
    if died:
        hear(Log(f"{final.problem} It is started once more."))
        wait_until_free(capture, lambda text: hear(Log(text)), cancelled)
        final, _ = _run_worker(capture, hear, cancelled, environment, job)
    return final


def _run_worker(
    capture: Capture,
    hear: Callable[[Message], None],
    cancelled: Callable[[], bool],
    environment: dict[str, str],
    job: Path,
) -> tuple[Message, bool]:
    """Return a worker's final message, and whether it died."""
    worker = Worker(Path(sys.executable), ROOT, job, capture.logs / "worker.log", {**environment, **_paid_key(job)})
    worker.start()
    try:
        while True:
            for message in worker.poll():
                if isinstance(message, FINAL):
                    return message, worker.died
                hear(message)
            if cancelled():
                worker.cancel()
            time.sleep(POLL_S)
    finally:
        worker.terminate()  # after an exception


def _paid_key(job: Path) -> dict[str, str]:
    """Return this process's key of the paid service, for a job that uses the service only."""
    key = os.environ.get(switchlight_api.KEY_VARIABLE)
    is_paid = key and read_job(job).settings.delight.delighter == "switchlight"
    return {switchlight_api.KEY_VARIABLE: key} if is_paid else {}


def _render_sheet(
    blender: str, capture: Capture, hear: Callable[[Message], None], cancelled: Callable[[], bool]
) -> Message:
    """Render the contact sheet with a Blender that has the extension. Raises Problem if it does not."""
    hear(Log("Rendering the contact sheet"))
    capture.logs.mkdir(parents=True, exist_ok=True)
    log = capture.logs / "contact_sheet.log"
    command = [blender, "--command", "wildcap", "contact_sheet", str(capture.root)]
    environment = switchlight_api.environment_without_key()
    with open(log, "wb") as output:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environment)
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
