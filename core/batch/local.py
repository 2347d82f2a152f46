# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on this machine: several faces at a time, each through its tasks; one that fails does not stop the others.

Whoever runs a batch holds its lease. BATCH/progress.json shows how far it is; an empty file BATCH/stop asks it to end,
as Ctrl-C does. Standard library only.
"""

from __future__ import annotations

import contextlib
import os
import stat
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

from ..capture.files import write_json
from ..capture.messages import Cancelled, Done, Failed, Message, Problem, Progress
from ..capture.stages import LABELS
from .groups import StageGroup, groups_until
from .record import Batch, BatchFace
from .state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState, derive_state
from .task import run_task

PROGRESS, STOP = "progress.json", "stop"
CANCELLED = "cancelled"
EVERY_S = 1.0
"""Shortest time between two writes of progress.json."""


class Board:
    """Thread-safe output of a run: lines through `tell`, and progress.json."""

    def __init__(self, batch: Batch, faces: int, tell: Callable[[str], None]):
        self._batch, self._faces, self._tell = batch, faces, tell
        self._working: dict[str, dict] = {}
        self._lock = threading.Lock()
        self._written = 0.0
        self._began = time.monotonic()
        self.ended: dict[str, str] = {}  # face -> DONE, WAITING, STOPPED or CANCELLED
        self.worked: set[str] = set()  # faces for which a task was run

    def say(self, face: BatchFace, words: str) -> None:
        with self._lock:
            self._tell(f"{face.name}: {words}")

    def hear(self, face: BatchFace, message: Message) -> None:
        """Note the progress of a face's worker."""
        if isinstance(message, Progress):
            share, stage = message.done / message.of if message.of else 0.0, LABELS[message.stage]
            begins = self._working.get(face.name, {}).get("stage") != stage
            self._working[face.name] = {"stage": stage, "share": round(share, 3), "eta_s": message.eta_s}
            self.write(now=begins)  # the first report of a stage may be the only one for a minute

    def end(self, face: BatchFace, state: str, words: str) -> None:
        self._working.pop(face.name, None)
        self.ended[face.name] = state
        left = self.left_s()
        estimate = f", about {max(1, round(left / 60))} min left" if left else ""
        self.say(face, f"{words} ({len(self.ended)} of {self._faces}{estimate})")
        self.write(now=True)

    def left_s(self) -> float | None:
        """Estimate the time left from the faces that this run worked on."""
        paced = len(self.worked & self.ended.keys())
        return (time.monotonic() - self._began) / paced * (self._faces - len(self.ended)) if paced else None

    def write(self, now: bool = False) -> None:
        """Write progress.json, at most every EVERY_S unless `now`."""
        with self._lock:
            if not now and time.monotonic() - self._written < EVERY_S:
                return
            self._written = time.monotonic()
            ended, working = len(self.ended), dict(self._working)
            progress = {"ended": ended, "of": self._faces, "left_s": self.left_s(), "working": working}
            with contextlib.suppress(Problem):  # captures may lie on another disk than a full one
                write_json(self._batch.root / PROGRESS, progress)


def run_local(
    batch: Batch,
    faces: Iterable[BatchFace],
    at_once: int,
    retry: bool,
    tell: Callable[[str], None],
    until: str | None = None,
) -> dict[str, str]:
    """Run the remaining tasks of faces, `at_once` at a time; return face -> DONE, WAITING, STOPPED or CANCELLED.

    The caller holds the batch's lease. `retry` tries faces that have stopped again, `tell` takes lines about faces,
    `until` names the last task. KeyboardInterrupt or the file `stop` ends the run; finished stages are kept.
    """
    faces = list(faces)
    board, ended = Board(batch, len(faces), tell), threading.Event()
    threads = max(1, (os.cpu_count() or 1) // at_once) if at_once > 1 else None
    groups = groups_until(until)
    forget_stop(batch.root)
    board.write(now=True)
    with ThreadPoolExecutor(at_once) as pool:
        waiting = {pool.submit(_run_face, batch, face, groups, board, retry, ended.is_set, threads) for face in faces}
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.3, return_when=FIRST_COMPLETED)
                for each in done:
                    each.result()  # re-raise our own errors
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
    return board.ended


def ask_to_stop(root: Path) -> None:
    """Ask whoever runs the batch in the folder `root` to stop. Raises OSError if the folder cannot be written."""
    (root / STOP).touch()


def is_asked_to_stop(root: Path) -> bool:
    """Return whether there is an empty file `stop`; any other content was not meant for us."""
    try:
        status = (root / STOP).lstat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_size == 0


def forget_stop(root: Path) -> None:
    if is_asked_to_stop(root):
        (root / STOP).unlink(missing_ok=True)


def next_task(
    batch: Batch, face: BatchFace, groups: tuple[StageGroup, ...], retry: bool, board: Board
) -> FaceState | None:
    """Return the state of a face with a task to run, its `group`; end the face on the board if there is none."""
    state = derive_state(batch, face)
    if state.state == STOPPED and retry and state.group is not None:
        state = replace(state, state=TO_DO)
    if state.state == DONE or state.group not in groups and state.state != STOPPED:
        board.end(face, DONE, "done")
    elif state.state in (TO_DO, WORKING):  # whoever works there may be gone: the task finds out
        return state
    else:
        board.end(face, WAITING if state.state == WAITING else STOPPED, state.words())
    return None


def _run_face(
    batch: Batch,
    face: BatchFace,
    groups: tuple[StageGroup, ...],
    board: Board,
    retry: bool,
    cancelled: Callable[[], bool],
    threads: int | None,
) -> None:
    while not cancelled():
        state = next_task(batch, face, groups, retry, board)
        if state is None:
            return
        retry = retry and not state.problem
        began, group = time.monotonic(), state.group
        board.worked.add(face.name)
        final = run_task(batch, face, group, lambda message: board.hear(face, message), cancelled, threads)
        final = check_result(batch, face, group, final)
        label = group.label.lower()
        if isinstance(final, Failed):
            return board.end(face, STOPPED, f"{label} stopped: {final.problem} {final.remedy}")
        if isinstance(final, Cancelled):
            break
        board.say(face, f"{label} done in {time.monotonic() - began:.0f} s")
    board.end(face, CANCELLED, "cancelled; finished stages are kept")


def check_result(batch: Batch, face: BatchFace, group: StageGroup, final: Message) -> Message:
    """Turn Done into Failed for a task that is still to do: it would be run again for ever."""
    if isinstance(final, Done) and derive_state(batch, face) == FaceState(TO_DO, group):
        return Failed(
            "",
            f"The task {group.name} succeeded, but its result is not what was asked for.",
            "Check whether another program writes to the capture.",
        )
    return final
