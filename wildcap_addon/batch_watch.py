# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Thread that watches a batch: the machine that runs it, its progress and the state of each face.

The first look at a face reads all its files, later ones compare a few file times. Nothing here touches Blender.
"""

import contextlib
import os
import threading
import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from ..core.batch import gate, local, state
from ..core.batch.known_hashes import known_hashes
from ..core.batch.record import NAME, Batch, BatchFace, read_batch
from ..core.batch.state import STOPPED, FaceState
from ..core.capture import lease, unforeseen
from ..core.capture.json_files import is_number, read_json
from ..core.capture.messages import Problem

EVERY_S = 0.5
"""Interval of the looks at the runner and its progress."""
REST, LONGEST_REST_S = 10, 5.0
"""Rest after a look at all faces, as a multiple of its duration: Python runs one thread at a time, and Blender's own
may lose a tenth. The limit keeps the display current."""


@dataclass(frozen=True)
class BatchView:
    """Known state of a batch.

    `states` has the faces that were examined, by name; `runner` is the machine that runs it, '' for none; `progress`
    comes from that run; `problem` is why the batch cannot be used.
    """

    batch: Batch | None = None
    states: dict[str, FaceState] = field(default_factory=dict)
    runner: str = ""
    progress: dict = field(default_factory=dict)
    problem: Problem | None = None

    def count(self, state: str) -> int:
        return sum(each.state == state for each in self.states.values())

    @cached_property
    def _faces(self) -> dict[str, BatchFace]:
        return {str(face.root): face for face in self.batch.faces} if self.batch else {}

    def face(self, root: str) -> BatchFace | None:
        """Return the face whose capture lies in that folder."""
        return self._faces.get(root)


class Watch(threading.Thread):
    """Thread that keeps `view` of a batch current; without a batch, `found` is a remembered one worth showing.

    `listed` has the capture folders of the scenes.
    """

    def __init__(self, root: Path | None, memory: Path):
        super().__init__(name="wildcap-batch", daemon=True)
        self.root, self._memory = root, memory
        self.view, self.found, self.listed = BatchView(), None, frozenset()
        self._record: tuple[int, Batch | None] = 0, None  # time of the record, and its content
        self._stamps: dict[str, tuple] = {}  # face -> what its state was derived from
        # time of the lease's last refresh, and when that was first observed (time.monotonic)
        self._refreshed: tuple[int, float] = 0, 0.0
        self._due = 0.0  # when all faces are examined again (time.monotonic)
        self._searched: tuple = ()
        self._ended = threading.Event()
        self.start()

    def end(self) -> None:
        self._ended.set()

    def run(self) -> None:
        while not self._ended.is_set():
            try:
                if self.root is None:
                    self._search()
                else:
                    self._look_at(self._read_batch())
            except Problem as problem:
                self.view = BatchView(problem=problem)
            except Exception as error:  # an uncaught one would end the thread silently
                self.view = BatchView(problem=unforeseen.explain(error, "looking at the batch"))
            self._ended.wait(EVERY_S)

    def _read_batch(self) -> Batch:
        time_ns = modified_ns(self.root / NAME)
        if self._record[1] is None or self._record[0] != time_ns:
            self._record = time_ns, read_batch(self.root)
            self._stamps.clear()  # the settings may differ, and so every state
            self._due = 0.0
        return self._record[1]

    def _look_at(self, batch: Batch) -> None:
        self._update(batch)
        began = time.monotonic()
        if began < self._due:
            return
        with contextlib.nullcontext() if self._stamps else known_hashes(batch.root):
            for face in batch.faces:
                if self._ended.is_set():
                    return
                self._look_at_face(batch, face)
        self._due = time.monotonic() + min(LONGEST_REST_S, REST * (time.monotonic() - began))

    def _look_at_face(self, batch: Batch, face: BatchFace) -> None:
        stamp = _stamp(face)
        # the holder of a lock may have ended
        if stamp[0] or self._stamps.get(face.name) != stamp or face.name not in self.view.states:
            face_state = _state_of(batch, face)
            self.view = replace(self.view, states={**self.view.states, face.name: face_state})
            self._stamps[face.name] = () if face_state.state == STOPPED and face_state.group is None else stamp
            self._update(batch)

    def _update(self, batch: Batch) -> None:
        """Update runner and progress, also between faces that take long to examine."""
        runner, names = self._live_runner(batch.root), {face.name for face in batch.faces}
        states = {name: each for name, each in self.view.states.items() if name in names}
        self.view = BatchView(batch, states, runner, _read_progress(batch.root) if runner else {})

    def _live_runner(self, root: Path) -> str:
        """Return the runner unless its lease was not refreshed for a whole term: then that machine is gone."""
        stamp = modified_ns(root / "lock")
        if stamp != self._refreshed[0]:
            self._refreshed = stamp, time.monotonic()
        return _runner(root) if time.monotonic() - self._refreshed[1] <= lease.TERM_S else ""

    def _search(self) -> None:
        """Find the newest batch that is running; if there is news to compare, else the newest with a listed capture."""
        roots, listed = remembered(self._memory), self.listed
        self.found = next((root for root in roots if _runner(root)), None)
        if self.found is None and (roots, listed) != self._searched:
            self._searched = roots, listed
            self.found = next((root for root in roots if listed & _captures_of(root)), None)


def modified_ns(path: Path) -> int:
    """Return the time of a file or folder in nanoseconds; 0 if there is none, or it was removed this moment."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def remembered(memory: Path) -> list[Path]:
    """Return the batches of a memory file that still exist, newest first."""
    try:
        return [Path(path) for path in read_json(memory) if (Path(path) / NAME).is_file()]
    except (OSError, ValueError, TypeError):
        return []


def _stamp(face: BatchFace) -> tuple:
    """Return what a face's state depends on, as far as file times say."""
    capture = face.capture
    watched = (
        capture.json,
        capture.root / gate.NAME,
        capture.shadow_mask_auto,
        capture.shadow_mask,
        capture.protect_mask,
        capture.texture,
        capture.solved,
        capture.renders / state.SHEET,
    )
    return (os.path.lexists(capture.lock), *map(modified_ns, watched))


def _state_of(batch: Batch, face: BatchFace) -> FaceState:
    """Return a face's state; without a group if its folder does not answer or is changing."""
    try:
        return state.derive_state(batch, face)
    except OSError as error:
        reason = f"The capture folder {face.root} cannot be read ({error.strerror or error})."
        return FaceState(STOPPED, None, reason, "Check that its disk or server is connected.")


def _runner(root: Path) -> str:
    """Return the machine that runs a batch; '' for none."""
    try:
        holder = lease.present_holder(root / "lock")
    except Problem:  # something else is in the lock's place: running it says so
        return ""
    return str(holder.get("host") or "...").partition("/")[0] if holder is not None else ""


def _read_progress(root: Path) -> dict:
    """Return progress.json; {} if it is missing or implausible."""
    try:
        progress = read_json(root / local.PROGRESS)
        working = {
            str(name): {"stage": str(each["stage"]), "share": each["share"]}
            for name, each in progress["working"].items()
            if is_number(each["share"])
        }
        ended, of, left = progress["ended"], progress["of"], progress["left_s"]
        plausible = is_number(ended, 0) and is_number(of, 0) and (left is None or is_number(left, 0))
        return {"ended": ended, "of": of, "left_s": left, "working": working} if plausible else {}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return {}


def _captures_of(root: Path) -> set[str]:
    try:
        return {str(face.root) for face in read_batch(root).faces}
    except Problem:
        return set()
