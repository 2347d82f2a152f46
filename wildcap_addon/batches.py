# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The batch that the tab shows: many faces that a process of its own, or a farm, works on. It goes on when Blender closes, and is found again.

What is done stands in the captures; a thread looks there, for a face that it sees for the first time costs the reading of all its files, and `poll` takes in
what it saw. Panels only read that. Which batch it is, the extension's user folder remembers: no .blend has to. Run-time state only.
"""

import contextlib
import os
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.batch import gate, local, state
from ..core.batch.groups import GATE, group_named
from ..core.batch.record import NAME, Batch, Face, read_batch
from ..core.batch.state import DONE, STOPPED, TO_DO, WAITING, WORKING, State
from ..core.contract import lease, unforeseen
from ..core.contract.files import write_json
from ..core.contract.json_files import is_number, read_json
from ..core.contract.messages import Problem
from . import captures, extension

EVERY_S = 0.5
"""Between two looks at who runs the batch, and how far that is."""
REST, LONGEST_REST_S = 10, 5.0
"""A look at all faces is followed by a rest of so many times its length: Python runs one thread at a time, and Blender's own is to be held up by a tenth at
most. In the longest rest an artist would begin to wonder."""
MOST = 10
"""Batches that are remembered."""
ICONS = {DONE: 'CHECKMARK', TO_DO: 'RADIOBUT_OFF', WORKING: 'PLAY', WAITING: 'BRUSH_DATA', STOPPED: 'ERROR'}


@dataclass(frozen=True)
class View:
    """A batch as it was seen last. `states` has the faces that were looked at, by name; `runner` is the machine that runs it, '' for none; `progress` is what
    it says of its run meanwhile; `problem` is why it cannot be used."""

    batch: Batch | None = None
    states: dict[str, State] = field(default_factory=dict)
    runner: str = ""
    progress: dict = field(default_factory=dict)
    problem: Problem | None = None

    def count(self, which: str) -> int:
        return sum(each.state == which for each in self.states.values())

    @cached_property
    def _faces(self) -> dict[str, Face]:
        return {str(face.root): face for face in self.batch.faces} if self.batch else {}

    def face(self, root: str) -> Face | None:
        """The face whose capture lies in that folder."""
        return self._faces.get(root)


class _Watch(threading.Thread):
    """Looks at a batch for as long as it is wanted; without one, for a remembered batch that is worth showing (`found`). Touches nothing of Blender's."""

    def __init__(self, root: Path | None, memory: Path):
        super().__init__(name="wildcap-batch", daemon=True)
        self.root, self._memory = root, memory
        self.view, self.found, self.listed = View(), None, frozenset()
        self._read: tuple[int, Batch | None] = 0, None  # when the record was changed that was read last, and what it said
        self._stamps: dict[str, tuple] = {}  # face -> what its state was derived from
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
                self.view = View(problem=problem)
            except Exception as error:  # nobody is above a thread
                self.view = View(problem=unforeseen.explain(error, "looking at the batch"))
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
        for face in batch.faces:
            if self._ended.is_set():
                return
            stamp = _stamp(face)
            if stamp[0] or self._stamps.get(face.name) != stamp or face.name not in self.view.states:  # who holds a lock may have ended
                found = _ask(batch, face)
                self.view = replace(self.view, states={**self.view.states, face.name: found})
                self._stamps[face.name] = () if found.state == STOPPED and found.group is None else stamp
                self._tell(batch)
        self._due = time.monotonic() + min(LONGEST_REST_S, REST * (time.monotonic() - began))

    def _tell(self, batch: Batch) -> None:
        """Who runs it and how far that is, also while a face takes long to look at."""
        runner, names = _runner(batch.root), {face.name for face in batch.faces}
        states = {name: each for name, each in self.view.states.items() if name in names}
        self.view = View(batch, states, runner, _read_progress(batch.root) if runner else {})

    def _search(self) -> None:
        """The newest that is being run; or else, when there is something new to compare, the newest with a capture of the scenes."""
        roots, listed = _remembered(self._memory), self.listed
        self.found = next((root for root in roots if _runner(root)), None)
        if self.found is None and (roots, listed) != self._searched:
            self._searched = roots, listed
            self.found = next((root for root in roots if listed & _captures_of(root)), None)


_watch: _Watch | None = None
_shown: tuple = ()
_accepted: set[str] = set()  # captures whose mask was accepted since they were last looked at


def current() -> Path | None:
    """The folder of the batch that is open."""
    return _watch.root if _watch is not None else None


def view() -> View:
    """As it was seen last; empty before."""
    return _watch.view if current() else View()


def choose(root: Path) -> None:
    """Makes a batch the open one, and remembers it."""
    _remember([root, *(other for other in _remembered(_memory()) if other != root)])
    if current() != root:
        _replace_watch(root)


def close() -> None:
    """No batch is open; the one that was is not found again by itself."""
    _remember(other for other in _remembered(_memory()) if other != current())
    _replace_watch(None)


def state_of(root: str) -> State | None:
    """Of a capture that belongs to the batch."""
    face = view().face(root)
    found = view().states.get(face.name) if face else None
    if found is not None and found.state == WAITING and root in _accepted:
        return State(TO_DO, group_named(GATE))
    return found


def works_on(root: str) -> bool:
    """Whether the batch has a capture in hand, or somebody else has one of its."""
    face, found = view().face(root), state_of(root)
    return face is not None and (face.name in view().progress.get("working", {}) or found is not None and found.state == WORKING)


def waiting() -> list[Face]:
    """The faces whose masks wait to be looked at, in the batch's order."""
    known = view()
    return [face for face in known.batch.faces if (found := state_of(str(face.root))) and found.state == WAITING] if known.batch else []


def ready() -> int:
    """How many faces are to be solved with a mask that was looked at."""
    found = [state_of(str(face.root)) for face in view().batch.faces] if view().batch else []
    return sum(each is not None and each.state == TO_DO and each.group is not None and each.group.name == GATE for each in found)


def accept(face: Face) -> None:
    """The mask is good as it is. Raises Problem where there is none."""
    gate.accept_mask(face.capture)
    _accepted.add(str(face.root))


def poll() -> bool:
    """Takes in what was seen since the last call; whether the tab shows something else now. Tests call it in place of the timer."""
    global _shown
    if _watch is None:
        _replace_watch(None)
    _watch.listed = frozenset(captures.root(item) for scene in bpy.data.scenes for item in scene.wildcap.captures)
    if _watch.root is None and _watch.found is not None:
        choose(_watch.found)
    known = view()
    for root in list(_accepted):
        face = known.face(root)
        if face is None or face.name in known.states and known.states[face.name].state != WAITING:
            _accepted.discard(root)
    before, _shown = _shown, (current(), known.states, known.runner, bool(known.problem), line(known), share(known), frozenset(_accepted))
    return before != _shown


def line(known: View) -> str:
    """What is being done, and how long all of it takes: 'Anna: Cameras 40 %, about 20 min left'; '' where nothing is told."""
    words = [iface_("{}: {} {}").format(name, iface_(each["stage"]), f"{each['share']:.0%}") for name, each in known.progress.get("working", {}).items()][:3]
    if known.progress.get("left_s") is not None:
        words.append(iface_("about {} min left").format(max(1, round(known.progress["left_s"] / 60))))
    return ", ".join(words)


def share(known: View) -> float:
    """The part of a run's faces that have ended, in [0, 1]."""
    return min(1.0, known.progress["ended"] / known.progress["of"]) if known.progress.get("of") else 0.0


def _replace_watch(root: Path | None) -> None:
    global _watch
    if _watch is not None:
        _watch.end()
    _accepted.clear()
    _watch = _Watch(root, _memory())


def _stamp(face: Face) -> tuple:
    """What a face's state depends on, as far as one look at its folder tells."""
    capture = face.capture
    watched = (capture.json, capture.root / gate.NAME, capture.shadow_mask_auto, capture.shadow_mask, capture.protect_mask, capture.texture, capture.solved,
               capture.renders / state.SHEET)
    return (os.path.lexists(capture.lock), *(_changed(path) for path in watched))


def _ask(batch: Batch, face: Face) -> State:
    """Where a face is; without a group where its folder does not answer, or changes under the look."""
    try:
        return state.look(batch, face)
    except OSError as error:
        return State(STOPPED, None, f"The capture folder {face.root} cannot be read ({error.strerror or error}).", "See that its disk or server is connected.")


def _changed(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def _runner(root: Path) -> str:
    """The machine that runs a batch; '' for none."""
    try:
        holder = lease.holder(root / "lock")
    except Problem:  # something else is in the lock's place: running it says so
        return ""
    return str(holder.get("host") or "...").partition("/")[0] if holder is not None else ""


def _read_progress(root: Path) -> dict:
    """progress.json, as far as it makes sense; {} for none."""
    try:
        told = read_json(root / local.PROGRESS)
        working = {str(name): {"stage": str(each["stage"]), "share": each["share"]} for name, each in told["working"].items() if is_number(each["share"])}
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


def _memory() -> Path:
    return Path(bpy.utils.extension_path_user(extension.NAME, create=True)) / "batches.json"


def _remembered(memory: Path) -> list[Path]:
    """The newest first."""
    try:
        return [Path(path) for path in read_json(memory) if (Path(path) / NAME).is_file()]
    except (OSError, ValueError, TypeError):
        return []


def _remember(roots: Iterable[Path]) -> None:
    with contextlib.suppress(Problem, OSError, ValueError):  # a folder that cannot be written: it is found no more when Blender was closed
        write_json(_memory(), [str(root) for root in roots][:MOST])


def register():
    pass


def unregister():
    """The batch goes on: only the looking ends."""
    global _watch, _shown
    if _watch is not None:
        _watch.end()
    _watch, _shown = None, ()
    _accepted.clear()
