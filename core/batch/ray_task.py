# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A Ray node's side of a batch: show that it can work, and run tasks. Needs no Ray itself, standard library only.

An outcome is {"state", "words", "seconds", "host"}. BATCH/logs/HOST.jsonl records which stages a node began and
finished; nothing is ever derived from it.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

from .. import __version__
from ..capture import lease
from ..capture.capture import Capture
from ..capture.hashes import hash_file
from ..capture.messages import Cancelled, Done, Failed, Message, Problem, Progress, StageDone, to_line
from .groups import group_named
from .local import CANCELLED, EVERY_S, check_result
from .record import NAME, Batch, read_batch
from .state import DONE, STOPPED, WAITING, FaceState, waits
from .task import run_task

BATCHES = "WILDCAP_BATCHES"
"""Environment variable of a node: the folder of the batches there, if it differs from ours."""
LOGS = "logs"


def find_batch(root: str) -> Batch:
    """Return the batch whose folder is `root` on the machine that runs it. Raises Problem."""
    folder = os.environ.get(BATCHES)
    return read_batch(Path(folder) / Path(root).name if folder else root)


def examine(root: str, version: str, record: str) -> str:
    """Return what keeps this node from working on the batch, or ''.

    `version` is WildCap's on the machine that runs the batch, `record` the hash of its batch.json.
    """
    host = socket.gethostname()
    if __version__ != version:
        return f"The node {host} has WildCap {__version__}, and this is {version}."
    if importlib.util.find_spec("torch") is None:
        return f"The Python of Ray's node {host} has no torch."
    try:
        if hash_file(find_batch(root).root / NAME) != record:
            return f"The node {host} sees another batch at {find_batch(root).root}."
    except (Problem, OSError) as error:
        return f"The node {host} does not see the batch: {error.problem if isinstance(error, Problem) else error}"
    return ""


def do_task(root: str, name: str, group_name: str, threads: int, stranger: str, say: Callable[[str], None]) -> dict:
    """Run a task of a face and return its outcome; `say` takes progress as lines of JSON.

    `stranger` is the token of a lease on the capture that was there before the batch, or ''. Any other holder is a task
    of ours whose process or node has died, and is waited for.
    """
    began, stopped, outcome = time.monotonic(), [], {"state": STOPPED, "words": "", "host": socket.gethostname()}
    before = signal.signal(signal.SIGINT, lambda number, frame: stopped.append(number))  # Ray's way to cancel
    try:
        batch, group = find_batch(root), group_named(group_name)
        face = batch.face(name)
        if waits(batch, face, group):
            return {**outcome, "state": WAITING, "words": FaceState(WAITING, group).words(), "seconds": 0.0}
        _outlast(face.capture, stranger, stopped)
        final = run_task(batch, face, group, _listener(batch, name, say), lambda: bool(stopped), threads)
        final = check_result(batch, face, group, final)
    except Problem as problem:
        final = Failed("", problem.problem, problem.remedy)
    finally:
        signal.signal(signal.SIGINT, before)
    outcome["state"] = {Done: DONE, Cancelled: CANCELLED, Failed: STOPPED}[type(final)]
    outcome["words"] = f"{final.problem} {final.remedy}" if isinstance(final, Failed) else ""
    return {**outcome, "seconds": round(time.monotonic() - began, 2)}


def _outlast(capture: Capture, stranger: str, stopped: list) -> None:
    """Wait until the worker of a killed task has ended, or the lease of a dead node has run out."""
    deadline = time.monotonic() + 2 * lease.TERM_S
    while not stopped:
        holder = lease.holder(capture.lock)
        if holder is None or holder.get("token") == stranger:
            return
        try:
            with capture.locked():
                return
        except Problem:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.5)


def _listener(batch: Batch, name: str, say: Callable[[str], None]) -> Callable[[Message], None]:
    """Return a function that passes a worker's progress on once in a while and logs the stages."""
    sent = [0.0]  # time of the last line
    account = batch.root / LOGS / f"{socket.gethostname()}.jsonl"

    def hear(message: Message) -> None:
        begins = isinstance(message, Progress) and (message.done, message.text) == (0, "Starting")
        if begins or isinstance(message, Progress) and time.monotonic() - sent[0] > EVERY_S:
            sent[0] = time.monotonic()
            say(to_line(message))
        if begins or isinstance(message, StageDone) and not message.skipped:
            finished = isinstance(message, StageDone)
            line = {"at": round(time.time(), 2), "face": name, "stage": message.stage, "finished": finished}
            with contextlib.suppress(OSError):
                account.parent.mkdir(exist_ok=True)
                with open(account, "a", encoding="utf-8") as file:
                    file.write(json.dumps({**line, "pid": os.getpid()}) + "\n")

    return hear
