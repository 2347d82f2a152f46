# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One function for each kind of trial: what is begun in a place, what strikes it, and what has to hold afterwards."""

from __future__ import annotations

import json
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Done, Failed
from core.worker.client import Worker
from core.worker.job import write_job

from .. import same_maps
from . import disk, judge
from .capture import ROOT, Undisturbed, capture_at, start_job
from .worker import Moment, fork_worker

SHORT_TERM_S = 1.0
"""The lease's term in trials in which one worker waits for another that sleeps."""
MOST_KILLS = 3
LATEST_S = 0.03
"""After a change of a file: what a library of C++ writes, it writes then."""
ROOM, PAGE = 64 << 20, 4096
SPARE = 1.2
"""Of what a stage needs for its files: some is written twice on the way."""


@dataclass
class KillTrial:
    """What a trial did and found. `where` says what was struck and when."""

    number: int
    kind: str
    rng: random.Random
    undisturbed: Undisturbed
    place: Path
    private: bool  # whether disks of our own can be made
    where: str = ""
    struck: int = 0
    faults: list[str] = field(default_factory=list)

    def stage(self) -> str:
        return self.rng.choice(self.undisturbed.names)

    def moment(self, stage: str, writing: bool) -> Moment:
        """A random one in the stage: of its time, or of its changes of files."""
        if not writing:
            return Moment(after_s=self.rng.uniform(0, 1.05 * self.undisturbed.seconds[stage]))
        late = self.rng.uniform(0, LATEST_S) if self.rng.random() < 0.5 else 0.0
        return Moment(write=self.rng.randint(1, self.undisturbed.changes[stage]), late_s=late)

    def begin(self, stage: str) -> None:
        """The place as it was before a stage, or with what the stage made of other settings."""
        again = self.rng.random() < 0.5
        self.undisturbed.copy(self.undisturbed.base(stage, again), self.place)
        self.where += f"{stage}{' again' if again else ''}"

    def resume(self, stage: str, masks: dict | None = None) -> None:
        """The undisturbed worker that goes on, and what has to hold at the end."""
        ended = start_job(self.place, **self.undisturbed.job(stage, resumed=True)).wait()
        if not isinstance(ended, Done):
            self.fault(f"the resumed run did not end well: {ended}")
        self.judge_end(stage, masks)

    def fault(self, text: str) -> None:
        self.faults.append(text)

    def judge_end(self, stage: str, masks: dict | None = None, unlike: tuple = (), unlike_folders: tuple = ()) -> None:
        """Take in the faults at the end of a run that went on.

        stage: the last one that was run."""
        self.faults += judge.judge_resume(self.place, self.undisturbed, stage, masks, unlike, unlike_folders)

    def judge_kill(self, masks: dict | None = None, within: tuple = ()) -> None:
        self.faults += [
            f"after the kill: {fault}" for fault in judge.judge_kill(self.place, self.undisturbed.known, masks, within)
        ]


def killed(trial: KillTrial, writing: bool) -> None:
    """A worker and its group are killed, up to three times in a row, and then left to end."""
    stage = trial.stage()
    trial.begin(stage)
    for number in range(1 + sum(trial.rng.random() < 0.25 for _ in range(MOST_KILLS - 1))):
        moment = trial.moment(stage, writing)
        trial.where += f", {moment}"
        trial.struck += start_job(trial.place, moment, **trial.undisturbed.job(stage, resumed=number > 0)).strike()
        trial.judge_kill()
    trial.resume(stage)


def command(trial: KillTrial) -> None:
    """The worker's own command as Blender starts it, killed while it imports, works or ends."""
    stage = trial.stage()
    trial.begin(stage)
    capture, after = capture_at(trial.place), trial.rng.uniform(0, 4 + trial.undisturbed.seconds[stage])
    trial.where += f", after {after:.3f} s"
    worker = Worker(
        Path(sys.executable), ROOT, write_job(capture, **trial.undisturbed.job(stage)), capture.logs / "worker.log"
    )
    worker.start()
    deadline = time.monotonic() + after
    while worker.running and time.monotonic() < deadline:
        worker.poll()
        time.sleep(0.001)
    trial.struck += worker.running
    worker.terminate()
    while worker.running:
        worker.poll()
        time.sleep(0.001)
    trial.judge_kill()
    trial.resume(stage)


def full(trial: KillTrial) -> None:
    """The disk is full at a random byte of what a stage writes; then there is room again. Without disks of our own: no
    file may be longer than some size."""
    stage = trial.stage()
    again, share = trial.rng.random() < 0.5, trial.rng.random()
    base, sizes = trial.undisturbed.base(stage, again), _sizes(trial.undisturbed.end.root, stage)
    told = trial.place.with_name(f"{trial.place.name}.told")
    if trial.private:
        trial.place.mkdir()
        disk.mount(trial.place, ROOM)
    shutil.copytree(base, trial.place, symlinks=True, dirs_exist_ok=True)
    job = write_job(capture_at(trial.place), **trial.undisturbed.job(stage))
    if trial.private:
        room = int(share * SPARE * sum(sizes))
        used = sum(-(-path.stat().st_size // PAGE) * PAGE for path in trial.place.rglob("*") if path.is_file())
        disk.resize(trial.place, used + 2 * PAGE + room)
    else:
        room = int(share * max(sizes))
    trial.where = f"{stage}{' again' if again else ''}, {room} bytes {'free' if trial.private else 'in a file'}"
    ended = fork_worker(job, told, most_bytes=None if trial.private else room).wait()
    trial.struck += isinstance(ended, Failed)
    words = "disk is full" if trial.private else "could not be written"
    if not isinstance(ended, Failed | Done):
        trial.fault("the worker ended without a word")
    elif isinstance(ended, Failed) and words not in ended.problem:
        trial.fault(f"a full disk is told as {ended.problem!r}")
    trial.judge_kill()
    if trial.private:
        disk.resize(trial.place, ROOM)
    trial.resume(stage)


def _sizes(root: Path, stage: str) -> list[int]:
    """Of the files that a stage writes."""
    return [(root / name).stat().st_size for name in same_maps.written(Capture(root), stages.by_name(stage))]


def asleep(trial: KillTrial) -> None:
    """A worker is stopped, a second one takes its place after the lease's term, and the first one awakes, meanwhile or
    afterwards: it changes nothing."""
    stage = trial.stage()
    trial.begin(stage)
    moment, meanwhile = trial.moment(stage, writing=False), trial.rng.random() < 0.5
    trial.where += f", stopped {moment}, awakes {'meanwhile' if meanwhile else 'afterwards'}"
    first = start_job(trial.place, moment, limits={"term_s": SHORT_TERM_S}, **trial.undisturbed.job(stage))
    if not first.strike(signal.SIGSTOP):
        trial.resume(stage)
        return
    trial.struck += 1
    capture = capture_at(trial.place)
    second = fork_worker(
        capture.job, trial.place.with_name(f"{trial.place.name}.second"), Moment(write=10**9), term_s=SHORT_TERM_S
    )
    if meanwhile:
        wait_until(lambda: second.pid == _holder(capture.lock) or second.ended())
        time.sleep(trial.rng.uniform(0, trial.undisturbed.seconds[stage]))
        first.send(signal.SIGCONT)
    ended = second.wait()
    if not isinstance(ended, Done):
        trial.fault(f"the second worker did not end well: {ended}")
    before = judge.tree(capture.root)
    if not meanwhile:
        first.send(signal.SIGCONT)
    awake = first.wait()
    changed = {name for name, digest in judge.tree(capture.root).items() if before.get(name) != digest} - {
        "written.jsonl",
        f"logs/{stage}.log",
    }
    if changed:
        trial.fault(f"the first worker changed {', '.join(sorted(changed))} after it had been replaced")
    if not isinstance(awake, Failed | Done) or isinstance(awake, Failed) and "nother worker" not in awake.problem:
        trial.fault(f"the first worker ended with {awake}")
    trial.resume(stage)


def _holder(lock: Path) -> int | None:
    try:
        return json.loads(lock.read_text(encoding="utf-8"))["pid"]
    except (OSError, ValueError, KeyError):
        return None


def wait_until(true: Callable[[], object], limit_s: float = 10 * SHORT_TERM_S) -> None:
    """Return then, or when the time is over."""
    deadline = time.monotonic() + limit_s
    while not true() and time.monotonic() < deadline:
        time.sleep(0.002)


def at_once(trial: KillTrial) -> None:
    """Two workers are started at the same job: one does it, the other one is refused by name, or finds it done when it
    comes late."""
    stage = trial.stage()
    trial.begin(stage)
    job = write_job(capture_at(trial.place), **trial.undisturbed.job(stage))
    workers = [fork_worker(job, trial.place.with_name(f"{trial.place.name}.{name}")) for name in ("first", "second")]
    ends = [worker.wait() for worker in workers]
    refused = [end for end in ends if isinstance(end, Failed) and end.problem.startswith("Another worker")]
    trial.struck += len(refused)
    if not any(isinstance(end, Done) for end in ends) or len(refused) + sum(isinstance(end, Done) for end in ends) < 2:
        trial.fault(f"two at once ended with {ends}")
    trial.judge_kill()
    trial.resume(stage)
