# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core batch: plan, run, status, retry, accept, review, commands, task.

Standard library only; Ray is imported only where a batch runs on it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shlex
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ..capture import lease
from ..capture.files import storage_problem
from ..capture.messages import Cancelled, Failed, Problem
from ..settings import settings
from ..worker import command_settings
from ..worker.commands import add_command, path_of
from ..worker.terminal import ProgressLine, print_message
from .gate import accept_mask
from .groups import GROUPS, group_named
from .known_hashes import known_hashes
from .lines import list_flamenco_jobs, list_tasks
from .local import CANCELLED, run_local
from .record import GATES, NAME, Batch, read_batch, write_batch
from .review import list_riskiest, write_review
from .shots import HEADINGS, choose_tones, read_faces
from .state import DONE, STOPPED, WAITING, derive_state
from .task import ROOT, run_task

CORES_PER_TASK = 2
"""Cores that a task takes on a Ray node."""
NONE = "none"


def add_commands(commands) -> None:
    """Add `batch` to the subparsers of `python -m core`."""
    batch = commands.add_parser("batch", help="process many faces: plan them, run them here or on a farm, review them")
    batch = batch.add_subparsers(required=True, metavar="plan|run|status|retry|accept|review|commands|task")
    _add_plan(batch)
    _add_run(batch, "run", "do what is left; faces that stopped with a problem stay")
    _add_run(batch, "retry", "do what is left, including faces that stopped")
    add_command(batch, "status", _status, "show how far each face is", "BATCH")
    accept = add_command(batch, "accept", _accept, "accept shadow masks as they are, to be solved with", "BATCH")
    accept.add_argument("names", metavar="NAME", nargs="+")
    add_command(batch, "review", _review, "write a page that shows all faces, the riskiest first", "BATCH")
    lines = add_command(batch, "commands", _commands, "list the tasks left: name, dependency, command", "BATCH")
    lines.add_argument("--python", default=sys.executable, help="the solver's Python on the machines that run them")
    lines.add_argument("--wildcap", metavar="FOLDER", default=ROOT, help="WildCap's folder there, which holds core")
    lines.add_argument("--flamenco", action="store_true", help="print a Flamenco job as JSON for each face instead")
    task = add_command(batch, "task", _task, "do one task of one face, for a scheduler", "BATCH")
    task.add_argument("name", metavar="NAME")
    task.add_argument("group", metavar="TASK", help=", ".join(group.name for group in GROUPS))


def _add_plan(batch) -> None:
    plan = add_command(batch, "plan", _plan, "make a batch from a table or a folder of videos, or add new ones to it")
    shots = f"a CSV with the columns {', '.join(HEADINGS)}, of which only video is required; or a folder"
    plan.add_argument("shots", metavar="SHOTS", type=path_of, help=shots)
    plan.add_argument("batch", metavar="BATCH", type=path_of, help="the batch's folder, with a capture for each face")
    plan.add_argument("--quality", choices=settings.QUALITIES, default="standard")
    plan.add_argument("--gate", choices=GATES, help="artist: solve a face only after its shadow mask was accepted")
    plan.add_argument("--deliver", metavar="PRESET", help="deliver each head (`presets` lists them); none: stop that")
    plan.add_argument("--to", metavar="FOLDER", type=path_of, help="folder of the deliveries, by default the captures")
    plan.add_argument("--blender", metavar="PROGRAM", help="a Blender that renders contact sheets; none: stop that")
    command_settings.add_assignments(plan, "run")


def _add_run(batch, name: str, words: str) -> None:
    run = add_command(batch, name, _run, words, "BATCH")
    run.add_argument("names", metavar="NAME", nargs="*", help="faces, by default all")
    run.add_argument("--on", choices=("local", "ray"), default="local", help="this machine, or a Ray cluster")
    run.add_argument("--address", help="address of Ray's head node; by default a cluster of this machine alone")
    run.add_argument("--at-once", metavar="N", type=int, help="faces at the same time on this machine, by default 1")
    cores = "cores of a Ray node per task, by default 2; the same number gives the same bytes"
    run.add_argument("--cores", metavar="N", type=int, help=cores)
    run.add_argument("--until", choices=[group.name for group in GROUPS], help="end each face with this task")
    run.set_defaults(retry=name == "retry")


def _plan(options: argparse.Namespace) -> int:
    if options.batch.is_file():
        raise Problem(
            f"{options.batch} is a file; BATCH is a folder, in which the captures are kept.",
            f"The table comes first: `python -m core batch plan {shlex.quote(str(options.batch))} BATCH`.",
        )
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
        choose_tones(faces, before.faces)
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
    flags = {"--at-once": options.at_once, "--cores": options.cores, "--address": options.address}
    for flag, value in flags.items():
        where = "local" if flag == "--at-once" else "ray"
        if value is not None and options.on != where:
            raise Problem(f"{flag} goes with --on {where} only.", f"Add --on {where}, or leave {flag} out.")
        if isinstance(value, int) and value < 1:
            raise Problem(f"{flag} is less than one.", "Leave it out, or give a whole number from 1 on.")
    with _held(batch), known_hashes(batch.root):
        if options.on == "ray":
            from .ray_cluster import run_on_ray

            ended = run_on_ray(
                batch, faces, options.retry, _tell, options.until, options.address, options.cores or CORES_PER_TASK
            )
        else:
            ended = run_local(batch, faces, options.at_once or 1, options.retry, _tell, options.until)
    return _sum_up(ended, len(faces))


@contextlib.contextmanager
def _held(batch: Batch) -> Iterator[None]:
    """Hold the batch's lease. Raises Problem."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(lease.hold_file(batch.root / "lock", _tell, "batch"))
        except OSError as error:
            raise storage_problem(error, batch.root) from error
        yield


def _sum_up(ended: dict[str, str], of: int) -> int:
    """Print how many faces ended how; return the exit code."""
    count = Counter(ended.values())
    counts = [
        (count[DONE], "done"),
        (count[WAITING], "waiting for the artist"),
        (count[STOPPED], "stopped"),
        (of - len(ended) + count[CANCELLED], "not reached"),
    ]
    print(f"{of} face{'' if of == 1 else 's'}: " + ", ".join(f"{number} {words}" for number, words in counts if number))
    return 2 if count[STOPPED] else 130 if counts[-1][0] else 0


def _tell(text: str) -> None:
    print(text, flush=True)


def _status(options: argparse.Namespace) -> int:
    batch = read_batch(options.batch)
    counts: Counter[str] = Counter()
    with known_hashes(batch.root):
        for face in batch.faces:
            state = derive_state(batch, face)
            counts[state.state] += 1
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
