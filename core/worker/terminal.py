# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker in a terminal: one line of progress with the time left, one line per finished stage."""

from __future__ import annotations

import os
import shutil
import sys
import time
from pathlib import Path

from ..capture import stages, switchlight_api
from ..capture.capture import Capture
from ..capture.messages import Cancelled, Done, Failed, Log, Message, Progress, StageDone
from .client import Worker
from .job import read_job
from .output import OutputLost

POLL_S = 0.1  # between two looks at the job


def follow(root: Path, capture: Capture, job: Path, environment: dict[str, str]) -> int:
    """Run a job with this Python and the code in `root`, and print its messages.

    `environment` is added to the worker's. Returns the exit code: 0, 2 for a problem, 130 after Ctrl-C.
    """
    if read_job(job).settings.delight.delighter == "switchlight" and os.environ.get(switchlight_api.KEY_VARIABLE):
        environment = {**environment, switchlight_api.KEY_VARIABLE: os.environ[switchlight_api.KEY_VARIABLE]}
    worker = Worker(Path(sys.executable), root, job, capture.logs / "worker.log", environment)
    line = ProgressLine()
    worker.start()
    while True:
        try:
            for message in worker.poll():
                code = print_message(message, capture, line)
            if not worker.running:
                return code
            time.sleep(POLL_S)
        except KeyboardInterrupt:
            line.show("Cancelling ...")
            worker.cancel()
        except OutputLost:
            worker.cancel()  # it tidies up
            while worker.running:
                worker.poll()
                time.sleep(POLL_S)
            raise


def print_message(message: Message, capture: Capture, line: ProgressLine) -> int:
    """Print a message and return the exit code, which counts if it is the last one."""
    match message:
        case Progress():
            share = message.done / message.of if message.of else 0
            left = f", {_duration(message.eta_s)} left" if message.eta_s and message.eta_s >= 1 else ""
            text = f"{stages.LABELS[message.stage]:12} {share:4.0%}  {message.text}{left}"
            line.show(text, step=(message.stage, int(share * 4)))
        case Log():
            line.keep(message.text)
        case StageDone():
            ended = "unchanged" if message.skipped else f"done in {_duration(message.seconds)}"
            line.keep(f"{stages.LABELS[message.stage]:12} {ended}")
        case Done():
            where = f" {capture.report} has the pictures and figures." if capture.report.is_file() else ""
            line.keep(f"Finished in {_duration(message.seconds)}.{where}")
            return 0
        case Cancelled():
            line.keep("Cancelled; finished stages are kept, the same command continues.")
            return 130
        case Failed():
            line.clear()
            print(message.problem, message.remedy, sep="\n", file=sys.stderr)
            return 2
    return 1


class ProgressLine:
    """Line that is overwritten; where the output is no terminal, a new line per quarter of a stage."""

    def __init__(self):
        self._live = sys.stdout.isatty()
        self._shown = ""
        self._step = None

    def show(self, text: str, step: object = None) -> None:
        if self._live:
            text = text[: shutil.get_terminal_size().columns - 1]
            print("\r" + text.ljust(len(self._shown)), end="", flush=True)
            self._shown = text
        elif step is None or step != self._step:
            print(text, flush=True)
        self._step = step

    def keep(self, text: str) -> None:
        self.clear()
        print(text, flush=True)

    def clear(self) -> None:
        if self._shown:
            print("\r" + " " * len(self._shown) + "\r", end="", flush=True)
            self._shown = ""


def _duration(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
