# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on this machine: some faces at a time, each through its tasks. What one face lacks does not keep the others.
Standard library only.

Who runs a batch holds its lease. BATCH/progress.json is what a panel may show of it meanwhile; an empty file BATCH/stop
asks it to end, as Ctrl-C does.
"""

from __future__ import annotations

import contextlib
import os
import stat
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path

from ..capture.files import write_json
from ..capture.messages import Cancelled, Done, Failed, Message, Problem, Progress
from ..capture.stages import LABELS
from .groups import GROUPS, StageGroup
from .record import Batch, BatchFace
from .state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState, derive_state
from .task import run_task

PROGRESS, STOP = "progress.json", "stop"
CANCELLED = "cancelled"
EVERY_S = 1.0
"""How often progress.json is written at most."""


@dataclass
class Tally:
    """How a run went."""

    ended: dict[str, str] = field(default_factory=dict)  # face -> DONE, WAITING, STOPPED or CANCELLED
    worked: set[str] = field(default_factory=set)  # faces for which a task was run

    def count(self, state: str) -> int:
        return sum(ended == state for ended in self.ended.values())


class Board:
    """What a run has to say: lines for whoever reads along, and progress.json. Used by several threads."""

    def __init__(self, batch: Batch, faces: int, tell: Callable[[str], None]):
        self._batch, self._faces, self._tell = batch, faces, tell
        self._working: dict[str, dict] = {}
        self._lock = threading.Lock()
        self._written = 0.0
        self._began = time.monotonic()
        self.tally = Tally()

    def say(self, face: BatchFace, words: str) -> None:
        with self._lock:
            self._tell(f"{face.name}: {words}")

    def hear(self, face: BatchFace, message: Message) -> None:
        """Keeps what a face's worker says of its progress."""
        if isinstance(message, Progress):
            share, stage = message.done / message.of if message.of else 0.0, LABELS[message.stage]
            begins = self._working.get(face.name, {}).get("stage") != stage
            self._working[face.name] = {"stage": stage, "share": round(share, 3), "eta_s": message.eta_s}
            self.write(now=begins)  # of a stage that begins it may be the only word for a minute

    def end(self, face: BatchFace, state: str, words: str) -> None:
        self._working.pop(face.name, None)
        self.tally.ended[face.name] = state
        left = self.left_s()
        self.say(
            face,
            f"{words} ({len(self.tally.ended)} of "
            f"{self._faces}{f', about {max(1, round(left / 60))} min left' if left else ''})",
        )
        self.write(now=True)

    def left_s(self) -> float | None:
        """At the pace of the faces that this run had something to do for."""
        paced = len(self.tally.worked & self.tally.ended.keys())
        return (time.monotonic() - self._began) / paced * (self._faces - len(self.tally.ended)) if paced else None

    def write(self, now: bool = False) -> None:
        """progress.json, once in a while, or `now`."""
        with self._lock:
            if not now and time.monotonic() - self._written < EVERY_S:
                return
            self._written = time.monotonic()
            with contextlib.suppress(Problem):  # a full disk keeps nobody from working on a capture that lies elsewhere
                write_json(
                    self._batch.root / PROGRESS,
                    {
                        "ended": len(self.tally.ended),
                        "of": self._faces,
                        "left_s": self.left_s(),
                        "working": dict(self._working),
                    },
                )


def run_local(
    batch: Batch,
    faces: Iterable[BatchFace],
    at_once: int,
    retry: bool,
    tell: Callable[[str], None],
    until: str | None = None,
) -> Tally:
    """Runs what is to be done of these faces. The caller holds the batch's lease. Ends early by KeyboardInterrupt or
    the file `stop`; what was finished is kept.

    Parameters
    ----------
    batch : that they belong to
    faces : to work on
    at_once : how many at a time, 1 or more
    retry : whether a face that has stopped is tried again
    tell : takes lines about the faces
    until : the last task's name, None: all

    Returns
    -------
    How each face ended.
    """
    faces = list(faces)
    board, ended = Board(batch, len(faces), tell), threading.Event()
    threads = max(1, (os.cpu_count() or 1) // at_once) if at_once > 1 else None
    forget_stop(batch.root)
    board.write(now=True)
    with ThreadPoolExecutor(at_once) as pool:
        waiting = {pool.submit(_run_face, batch, face, board, retry, ended.is_set, until, threads) for face in faces}
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.3, return_when=FIRST_COMPLETED)
                for each in done:
                    each.result()  # an error of ours is told as one
                if is_asked_to_stop(batch.root):
                    ended.set()
        except BaseException:
            ended.set()
            raise
        finally:
            for each in waiting:
                each.cancel()
    forget_stop(batch.root)
    board.write(now=True)
    return board.tally


def ask_to_stop(root: Path) -> None:
    """Asks whoever runs the batch in the folder `root` to stop. Raises OSError where nothing can be written there."""
    (root / STOP).touch()


def is_asked_to_stop(root: Path) -> bool:
    """Whether the file `stop` is there; one that holds something was meant for something else."""
    try:
        status = (root / STOP).lstat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_size == 0


def forget_stop(root: Path) -> None:
    """Removes the file `stop`."""
    if is_asked_to_stop(root):
        (root / STOP).unlink(missing_ok=True)


def _run_face(
    batch: Batch,
    face: BatchFace,
    board: Board,
    retry: bool,
    cancelled: Callable[[], bool],
    until: str | None = None,
    threads: int | None = None,
) -> None:
    """One face's tasks, one after the other, as far as they go."""
    names = [group.name for group in GROUPS]
    last = names.index(until) if until else len(names) - 1
    while not cancelled():
        state = derive_state(batch, face)
        if state.state == STOPPED and retry and state.group is not None:
            state, retry = FaceState(TO_DO, state.group), False
        if state.state == DONE or (
            state.group is not None and names.index(state.group.name) > last and state.state != STOPPED
        ):
            return board.end(face, DONE, "done")
        if state.state not in (TO_DO, WORKING):  # who works there may be a machine that has gone: the task finds out
            return board.end(face, WAITING if state.state == WAITING else STOPPED, state.words())
        final = _run(batch, face, state.group, board, cancelled, threads)
        if isinstance(final, Failed):
            return board.end(face, STOPPED, f"{state.group.label.lower()} stopped: {final.problem} {final.remedy}")
        if isinstance(final, Cancelled):
            break
    board.end(face, CANCELLED, "cancelled; what was finished is kept")


def _run(
    batch: Batch, face: BatchFace, group: StageGroup, board: Board, cancelled: Callable[[], bool], threads: int | None
) -> Message:
    began = time.monotonic()
    board.tally.worked.add(face.name)
    final = run_task(batch, face, group, lambda message: board.hear(face, message), cancelled, threads)
    final = check_result(batch, face, group, final)
    if isinstance(final, Done):
        board.say(face, f"{group.label.lower()} done in {time.monotonic() - began:.0f} s")
    return final


def check_result(batch: Batch, face: BatchFace, group: StageGroup, final: Message) -> Message:
    """How a task has ended: not well where it is still, or again, to be done, for the next look would send it here
    again, for ever.

    Parameters
    ----------
    batch, face, group : whose task
    final : the message that it ended with

    Returns
    -------
    `final`, or a Failed in place of Done.
    """
    if isinstance(final, Done) and derive_state(batch, face) == FaceState(TO_DO, group):
        return Failed(
            "",
            f"The task {group.name} ended well, and its result is not what was asked for.",
            "Look whether another program writes there.",
        )
    return final
