# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core batch: plan, run, status, retry, accept, review, commands, task.

Standard library only; Ray is imported only where a batch runs on it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ..capture import lease
from ..capture.files import storage_problem
from ..capture.messages import Cancelled, Failed, Problem
from ..settings import settings
from ..worker import command_settings
from ..worker.commands import add_command
from ..worker.terminal import ProgressLine, print_message
from .gate import accept_mask
from .groups import GROUPS, group_named
from .known_hashes import known_hashes
from .lines import list_flamenco_jobs, list_tasks
from .local import CANCELLED, Tally, run_local
from .record import GATES, NAME, Batch, read_batch, write_batch
from .review import list_riskiest, write_review
from .shots import HEADINGS, read_faces
from .state import DONE, STOPPED, WAITING, derive_state
from .task import ROOT, run_task

CORES_PER_TASK = 2
"""Cores that a task takes on a Ray node."""
NONE = "none"


def add_commands(commands) -> None:
    """Add `batch` to the subparsers of `python -m core`."""
    many = commands.add_parser(
        "batch", help="many faces: plan them from a table, run them here or on a farm, review them"
    )
    many = many.add_subparsers(required=True, metavar="plan|run|status|retry|accept|review|commands|task")
    _add_plan(many)
    _add_runs(many)
    add_command(many, "status", _status, "say how far each face is", "BATCH")
    accept = add_command(
        many, "accept", _accept, "solve with the shadow mask as it is, where the batch waits for that", "BATCH"
    )
    accept.add_argument("names", metavar="NAME", nargs="+")
    add_command(
        many, "review", _review, "write the page that shows all faces, those to look at first in front", "BATCH"
    )
    lines = add_command(
        many,
        "commands",
        _commands,
        "one line for each task that is left: its name, the task it waits for, and the command",
        "BATCH",
    )
    lines.add_argument(
        "--python", default=sys.executable, help="the solver's Python on the machines that will run them"
    )
    lines.add_argument(
        "--wildcap", metavar="FOLDER", default=ROOT, help="WildCap's folder on those machines, the one that holds core"
    )
    lines.add_argument(
        "--flamenco",
        action="store_true",
        help="a line of JSON for each face instead: a job to submit to Flamenco (docs/farm.md)",
    )
    task = add_command(many, "task", _task, "do one task of one face, as a scheduler asks for it", "BATCH")
    task.add_argument("name", metavar="NAME")
    task.add_argument("group", metavar="TASK", help=", ".join(group.name for group in GROUPS))


def _add_plan(subcommands) -> None:
    plan = add_command(
        subcommands,
        "plan",
        _plan,
        "make a batch of a table of videos, or of a folder of them; planned again, it takes in what is new",
    )
    plan.add_argument(
        "shots",
        metavar="SHOTS",
        type=Path,
        help=f"a CSV with the columns {', '.join(HEADINGS)}, of which video alone is needed; or a folder",
    )
    plan.add_argument("batch", metavar="BATCH", type=Path, help="the batch's folder, with a capture for each face")
    plan.add_argument("--quality", choices=settings.QUALITIES, default="standard")
    plan.add_argument(
        "--gate",
        choices=GATES,
        help="artist: no face is solved before somebody has looked at its shadow mask; automatic: at once",
    )
    plan.add_argument(
        "--deliver",
        metavar="PRESET",
        help="deliver each head for that program as well (`presets` lists them); none: no more",
    )
    plan.add_argument(
        "--to", metavar="FOLDER", type=Path, help="folder of the deliveries; without it they lie in the captures"
    )
    plan.add_argument(
        "--blender",
        metavar="PROGRAM",
        help="a Blender with the extension, which renders a contact sheet of each face; none: no more",
    )
    command_settings.add_assignments(plan, "run")


def _add_runs(subcommands) -> None:
    for word, words in (
        ("run", "do what is left; what has stopped with a problem stays"),
        ("retry", "the same, and what has stopped is tried again"),
    ):
        run = add_command(subcommands, word, _run, words, "BATCH")
        run.add_argument("names", metavar="NAME", nargs="*", help="faces; without one, all")
        run.add_argument("--on", choices=("local", "ray"), default="local", help="this machine, or a cluster of Ray's")
        run.add_argument(
            "--address",
            help="Ray's head node, as `ray start` tells it; without it, this machine becomes a cluster of one",
        )
        run.add_argument(
            "--at-once", metavar="N", type=int, help="faces that this machine works on at the same time, else 1"
        )
        run.add_argument(
            "--cores",
            metavar="N",
            type=int,
            help="cores of a node of Ray's that a task takes, else 2: the same number gives the same bytes",
        )
        run.add_argument("--until", choices=[group.name for group in GROUPS], help="end each face with this task")
        run.set_defaults(retry=word == "retry")


def _plan(options: argparse.Namespace) -> int:
    root = options.batch.absolute()
    before = read_batch(root) if (root / NAME).is_file() else Batch(root, ())
    _refuse_strangers(root)
    batch = _with_options(before, options)
    faces, faults = read_faces(
        options.shots, root, options.quality, command_settings.read_options(options, "run"), before.faces
    )
    kept = [face for face in before.faces if face.name not in {new.name for new in faces}]
    if faces or kept:
        write_batch(replace(batch, faces=(*kept, *faces)))
    for fault in faults:
        print(f"{fault.problem} {fault.remedy}", file=sys.stderr)
    summary = f"{len(faces)} face{'' if len(faces) == 1 else 's'} planned in {root}"
    print(summary + (f", {len(kept)} of before kept" if kept else "") + (f", {len(faults)} left out" if faults else ""))
    return 2 if faults else 0


def _with_options(batch: Batch, options: argparse.Namespace) -> Batch:
    """Return the batch with the given options; others stay as they were planned. Raises Problem."""
    deliver = dict(batch.deliver or {})
    if options.deliver:
        deliver = {**deliver, "preset": options.deliver} if options.deliver != NONE else {}
    if options.to and not deliver:
        raise Problem("--to goes with --deliver only.", "Add --deliver PRESET, or leave --to out.")
    if options.to:
        deliver["folder"] = str(options.to.absolute())
    settings.from_json({"deliver": deliver})
    blender = batch.blender if options.blender is None else "" if options.blender == NONE else options.blender
    return replace(batch, gate=options.gate or batch.gate, deliver=deliver or None, blender=blender)


def _refuse_strangers(root: Path) -> None:
    """Raise Problem for a folder that is neither empty nor a batch."""
    try:
        names = sorted(path.name for path in root.iterdir()) if root.is_dir() else []
    except OSError as error:
        raise storage_problem(error, root) from error
    if names and not (root / NAME).is_file():
        raise Problem(f"{root} is not a batch (it contains {names[0]}).", "Name a new folder, and it will be made.")


def _run(options: argparse.Namespace) -> int:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    batch = read_batch(options.batch)
    faces = [batch.face(name) for name in dict.fromkeys(options.names)] or list(batch.faces)
    for flag, value, where in (
        ("--at-once", options.at_once, "local"),
        ("--cores", options.cores, "ray"),
        ("--address", options.address, "ray"),
    ):
        if value is not None and options.on != where:
            raise Problem(f"{flag} goes with --on {where} only.", f"Add --on {where}, or leave {flag} out.")
        if isinstance(value, int) and value < 1:
            raise Problem(f"{flag} is less than one.", "Leave it out, or give a whole number from 1 on.")
    with _held(batch), known_hashes(batch.root):
        if options.on == "ray":
            from .ray_cluster import run_on_ray

            tally = run_on_ray(
                batch, faces, options.retry, _tell, options.until, options.address, options.cores or CORES_PER_TASK
            )
        else:
            tally = run_local(batch, faces, options.at_once or 1, options.retry, _tell, options.until)
    return _sum_up(tally, len(faces))


@contextlib.contextmanager
def _held(batch: Batch) -> Iterator[None]:
    """Hold the batch's lease. Raises Problem."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(lease.hold(batch.root, _tell, "batch"))
        except OSError as error:
            raise storage_problem(error, batch.root) from error
        yield


def _sum_up(tally: Tally, of: int) -> int:
    counts = [
        (tally.count(DONE), "done"),
        (tally.count(WAITING), "waiting for the artist"),
        (tally.count(STOPPED), "stopped"),
        (of - len(tally.ended) + tally.count(CANCELLED), "not reached"),
    ]
    print(f"{of} face{'' if of == 1 else 's'}: " + ", ".join(f"{count} {words}" for count, words in counts if count))
    return 2 if tally.count(STOPPED) else 130 if counts[-1][0] else 0


def _tell(text: str) -> None:
    print(text, flush=True)


def _status(options: argparse.Namespace) -> int:
    batch = read_batch(options.batch)
    counts: dict[str, int] = {}
    with known_hashes(batch.root):
        for face in batch.faces:
            state = derive_state(batch, face)
            counts[state.state] = counts.get(state.state, 0) + 1
            print(f"{face.name:20} {state.words()}", flush=True)
    print(", ".join(f"{count} {state}" for state, count in counts.items()))
    with contextlib.suppress(Problem):
        holder = lease.present_holder(batch.root / "lock")
        if holder:
            machine = str(holder["host"]).partition("/")[0]
            print(f"The batch is being run on {machine} (process {holder['pid']}, since {holder['since']}).")
    return 0


def _accept(options: argparse.Namespace) -> int:
    batch = read_batch(options.batch)
    faces = [batch.face(name) for name in options.names]
    for face in faces:
        accept_mask(face.capture)
        print(f"{face.name} is solved with its mask next.")
    return 0


def _review(options: argparse.Namespace) -> int:
    batch = read_batch(options.batch)
    with known_hashes(batch.root):
        path, rows = write_review(batch)
    print(path, *list_riskiest(rows), sep="\n")
    return 0


def _commands(options: argparse.Namespace) -> int:
    batch = read_batch(options.batch)
    with known_hashes(batch.root):
        jobs = list_flamenco_jobs(batch) if options.flamenco else list_tasks(batch, options.python, options.wildcap)
    for each in jobs:
        print(json.dumps(each) if options.flamenco else each.line())
    return 0


def _task(options: argparse.Namespace) -> int:
    """Return 0, 2 for a problem, or 130 after Ctrl-C, as `run` does."""
    batch, stopped = read_batch(options.batch), []
    face, group, line = batch.face(options.name), group_named(options.group), ProgressLine()

    def stop(number, frame) -> None:
        stopped.append(number)

    for each in (signal.SIGINT, signal.SIGTERM):  # schedulers send either
        signal.signal(each, stop)
    final = run_task(
        batch, face, group, lambda message: print_message(message, face.capture, line), lambda: bool(stopped)
    )
    if isinstance(final, Failed):
        line.clear()
        raise Problem(final.problem, final.remedy)
    if isinstance(final, Cancelled):
        line.keep("Cancelled; finished stages are kept.")
        return 130
    line.keep(f"{face.name}: {group.label.lower()} done")
    return 0
