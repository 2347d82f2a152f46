# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core slim: a finished face, or those of a batch, without what their videos give again. Standard library
only."""

from __future__ import annotations

import argparse
import signal
from pathlib import Path

from ..contract import settings, slimmed, slimming
from ..contract.capture import Capture
from ..contract.deletion import megabytes
from ..contract.messages import Problem
from ..worker import terminal
from ..worker.commands import add_command
from ..worker.job import last_settings, write_job
from .record import NAME, Batch, read_batch
from .state import DONE, derive_state
from .task import ROOT


def add_commands(commands) -> None:
    """Adds `slim` to the subparsers of `python -m core`."""
    slim = add_command(
        commands,
        "slim",
        _slim,
        "remove what the video gives again in a minute, of a face that is done, or of a batch's; "
        "without --yes, list it",
    )
    slim.add_argument("folder", metavar="CAPTURE|BATCH", type=Path)
    what = slim.add_mutually_exclusive_group()
    what.add_argument("--yes", action="store_true", help="remove it; a stage that needs it later has it made again")
    what.add_argument("--undo", action="store_true", help="have it made again now")


def _slim(options: argparse.Namespace) -> int:
    """Exit codes as for `run`."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if (options.folder / NAME).is_file():
        batch = read_batch(options.folder)
        return _undo([face.capture for face in batch.faces]) if options.undo else _slim_batch(batch, options.yes)
    capture = Capture(options.folder)
    if options.undo:
        return _undo([capture])
    removal = (slimming.slim if options.yes else slimming.plan)(capture, last_settings(capture))
    print(*slimming.lines(removal, capture), sep="\n")
    if not options.yes:
        print("Nothing was removed; --yes does it.")
    return 0


def _slim_batch(batch: Batch, yes: bool) -> int:
    """Each face that is done; the others are left and said."""
    size = count = 0
    for face in batch.faces:
        state = derive_state(batch, face)
        if state.state != DONE:
            print(f"{face.name:20} left, for it is not done: {state.words()}", flush=True)
            continue
        try:
            removal = (slimming.slim if yes else slimming.plan)(face.capture, face.chosen())
        except Problem as problem:
            print(f"{face.name:20} left: {problem.problem} {problem.remedy}", flush=True)
            continue
        size, count = size + removal.size, count + bool(removal.going)
        print(
            f"{face.name:20} {len(removal.going)} files, {megabytes(removal.size)}"
            + "".join(f"; {note}" for note in removal.notes),
            flush=True,
        )
    print(
        f"{count} of {len(batch.faces)} faces, {megabytes(size)}"
        + ("" if yes else ". Nothing was removed; --yes does it.")
    )
    return 0


def _undo(captures: list[Capture]) -> int:
    """Brings back what was slimmed away; ends with the first capture where that fails."""
    for capture in captures:
        if not slimmed.hashes_of(capture.read()):
            print(f"{capture.root.stem}: nothing was slimmed away.")
            continue
        job = write_job(capture, tool="bring_back", settings=settings.to_json(last_settings(capture)))
        if code := terminal.follow(ROOT, capture, job, {}):
            return code
    return 0
