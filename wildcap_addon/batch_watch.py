# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The thread that looks at a batch: who runs it and how far that is, and where its faces are. A face that is seen for
the first time costs the reading of all its files, later a few file times. Nothing here touches Blender."""

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
"""Between two looks at who runs the batch, and how far that is."""
REST, LONGEST_REST_S = 10, 5.0
"""A look at all faces is followed by a rest of so many times its length: Python runs one thread at a time, and
Blender's own is to be held up by a tenth at most. In the longest rest an artist would begin to wonder."""


@dataclass(frozen=True)
class BatchView:
    """A batch as it was seen last. `states` has the faces that were looked at, by name; `runner` is the machine that
    runs it, '' for none; `progress` is what it says of its run meanwhile; `problem` is why it cannot be used."""

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
        """The face whose capture lies in that folder."""
        return self._faces.get(root)


class Watch(threading.Thread):
    """Looks at a batch for as long as it is wanted; without one, for a remembered batch that is worth showing
    (`found`). Touches nothing of Blender's."""

    def __init__(self, root: Path | None, memory: Path):
        super().__init__(name="wildcap-batch", daemon=True)
        self.root, self._memory = root, memory
        self.view, self.found, self.listed = BatchView(), None, frozenset()
        # when the record was changed that was read last, and what it said
        self._read: tuple[int, Batch | None] = 0, None
        self._stamps: dict[str, tuple] = {}  # face -> what its state was derived from
        # the time of the lease's last refresh, and when that was first seen (time.monotonic)
        self._refreshed: tuple[int, float] = 0, 0.0
        self._due = 0.0  # when all faces are looked at again (time.monotonic)
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
            except Exception as error:  # nobody is above a thread
                self.view = BatchView(problem=unforeseen.explain(error, "looking at the batch"))
            self._ended.wait(EVERY_S)

    def _read_batch(self) -> Batch:
        changed = _changed(self.root / NAME)
        if self._read[1] is None or self._read[0] != changed:
            self._read = changed, read_batch(self.root)
            self._stamps.clear()  # each is asked anew: other settings may have been asked for
            self._due = 0.0
        return self._read[1]

    def _look_at(self, batch: Batch) -> None:
        self._tell(batch)
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
        # who holds a lock may have ended
        if stamp[0] or self._stamps.get(face.name) != stamp or face.name not in self.view.states:
            face_state = _ask(batch, face)
            self.view = replace(self.view, states={**self.view.states, face.name: face_state})
            self._stamps[face.name] = () if face_state.state == STOPPED and face_state.group is None else stamp
            self._tell(batch)

    def _tell(self, batch: Batch) -> None:
        """Who runs it and how far that is, also while a face takes long to look at."""
        runner, names = self._ask_runner(batch.root), {face.name for face in batch.faces}
        states = {name: each for name, each in self.view.states.items() if name in names}
        self.view = BatchView(batch, states, runner, _read_progress(batch.root) if runner else {})

    def _ask_runner(self, root: Path) -> str:
        """As `_runner`; a machine that has refreshed its lease for a whole term no more has gone, and what it left is
        no obstacle."""
        stamp = _changed(root / "lock")
        if stamp != self._refreshed[0]:
            self._refreshed = stamp, time.monotonic()
        return _runner(root) if time.monotonic() - self._refreshed[1] <= lease.TERM_S else ""

    def _search(self) -> None:
        """The newest that is being run; or else, when there is something new to compare, the newest with a capture of
        the scenes."""
        roots, listed = remembered(self._memory), self.listed
        self.found = next((root for root in roots if _runner(root)), None)
        if self.found is None and (roots, listed) != self._searched:
            self._searched = roots, listed
            self.found = next((root for root in roots if listed & _captures_of(root)), None)


def _stamp(face: BatchFace) -> tuple:
    """What a face's state depends on, as far as one look at its folder tells."""
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
    return (os.path.lexists(capture.lock), *(_changed(path) for path in watched))


def _ask(batch: Batch, face: BatchFace) -> FaceState:
    """Where a face is; without a group where its folder does not answer, or changes under the look."""
    try:
        return state.derive_state(batch, face)
    except OSError as error:
        return FaceState(
            STOPPED,
            None,
            f"The capture folder {face.root} cannot be read ({error.strerror or error}).",
            "See that its disk or server is connected.",
        )


def _changed(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def _runner(root: Path) -> str:
    """The machine that runs a batch; '' for none."""
    try:
        holder = lease.present_holder(root / "lock")
    except Problem:  # something else is in the lock's place: running it says so
        return ""
    return str(holder.get("host") or "...").partition("/")[0] if holder is not None else ""


def _read_progress(root: Path) -> dict:
    """progress.json, as far as it makes sense; {} for none."""
    try:
        told = read_json(root / local.PROGRESS)
        working = {
            str(name): {"stage": str(each["stage"]), "share": each["share"]}
            for name, each in told["working"].items()
            if is_number(each["share"])
        }
        ended, of, left = told["ended"], told["of"], told["left_s"]
        sound = is_number(ended, 0) and is_number(of, 0) and (left is None or is_number(left, 0))
        return {"ended": ended, "of": of, "left_s": left, "working": working} if sound else {}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return {}


def _captures_of(root: Path) -> set[str]:
    try:
        return {str(face.root) for face in read_batch(root).faces}
    except Problem:
        return set()


def remembered(memory: Path) -> list[Path]:
    """The newest first."""
    try:
        return [Path(path) for path in read_json(memory) if (Path(path) / NAME).is_file()]
    except (OSError, ValueError, TypeError):
        return []
