# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The batch that the tab shows: many faces that a process of its own, or a farm, works on. It goes on when Blender
closes, and is found again.

What is done stands in the captures; a thread looks there, for a face that it sees for the first time costs the reading
of all its files, and `poll` takes in what it saw. Panels only read that. Which batch it is, the extension's user folder
remembers: no .blend has to. Run-time state only.
"""

import contextlib
from collections.abc import Iterable
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.batch import gate
from ..core.batch.groups import GATE, group_named
from ..core.batch.record import BatchFace
from ..core.batch.state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState
from ..core.capture.files import write_json
from ..core.capture.messages import Problem
from . import captures, extension
from .batch_watch import BatchView, Watch, remembered

MOST_ROWS = 10
"""Batches that are remembered."""
ICONS = {DONE: 'CHECKMARK', TO_DO: 'RADIOBUT_OFF', WORKING: 'PLAY', WAITING: 'BRUSH_DATA', STOPPED: 'ERROR'}
_watch: Watch | None = None
_shown: tuple = ()
_accepted: set[str] = set()  # captures whose mask was accepted since they were last looked at


def current() -> Path | None:
    """The folder of the batch that is open."""
    return _watch.root if _watch is not None else None


def view() -> BatchView:
    """As it was seen last; empty before."""
    return _watch.view if current() else BatchView()


def choose(root: Path) -> None:
    """Makes a batch the open one, and remembers it."""
    _remember([root, *(other for other in remembered(_memory()) if other != root)])
    if current() != root:
        _replace_watch(root)


def close() -> None:
    """No batch is open; the one that was is not found again by itself."""
    _remember(other for other in remembered(_memory()) if other != current())
    _replace_watch(None)


def state_of(root: str) -> FaceState | None:
    """Of a capture that belongs to the batch."""
    face = view().face(root)
    face_state = view().states.get(face.name) if face else None
    if face_state is not None and face_state.state == WAITING and root in _accepted:
        return FaceState(TO_DO, group_named(GATE))
    return face_state


def works_on(root: str) -> bool:
    """Whether the batch has a capture in hand, or somebody else has one of its."""
    face, face_state = view().face(root), state_of(root)
    return face is not None and (
        face.name in view().progress.get("working", {}) or face_state is not None and face_state.state == WORKING
    )


def waiting() -> list[BatchFace]:
    """The faces whose masks wait to be looked at, in the batch's order."""
    known = view()
    return (
        [face for face in known.batch.faces if (status := state_of(str(face.root))) and status.state == WAITING]
        if known.batch
        else []
    )


def ready() -> int:
    """How many faces are to be solved with a mask that was looked at."""
    face_states = [state_of(str(face.root)) for face in view().batch.faces] if view().batch else []
    return sum(
        each is not None and each.state == TO_DO and each.group is not None and each.group.name == GATE
        for each in face_states
    )


def accept(face: BatchFace) -> None:
    """The mask is good as it is. Raises Problem where there is none."""
    gate.accept_mask(face.capture)
    _accepted.add(str(face.root))


def poll() -> bool:
    """Takes in what was seen since the last call; whether the tab shows something else now. Tests call it in place of
    the timer."""
    global _shown
    if _watch is None:
        _replace_watch(None)
    _watch.listed = frozenset(map(captures.root, captures.listed()))
    if _watch.root is None and _watch.found is not None:
        choose(_watch.found)
    known = view()
    for root in list(_accepted):
        face = known.face(root)
        if face is None or face.name in known.states and known.states[face.name].state != WAITING:
            _accepted.discard(root)
    before, _shown = (
        _shown,
        (current(), known.states, known.runner, bool(known.problem), line(known), share(known), frozenset(_accepted)),
    )
    return before != _shown


def line(view: BatchView) -> str:
    """What is being done, and how long all of it takes: 'Anna: Cameras 40 %, about 20 min left'; '' where nothing is
    told."""
    words = [
        iface_("{}: {} {}").format(name, iface_(each["stage"]), f"{each['share']:.0%}")
        for name, each in view.progress.get("working", {}).items()
    ][:3]
    if view.progress.get("left_s") is not None:
        words.append(iface_("about {} min left").format(max(1, round(view.progress["left_s"] / 60))))
    return ", ".join(words)


def share(view: BatchView) -> float:
    """The part of a run's faces that have ended, in [0, 1]."""
    return min(1.0, view.progress["ended"] / view.progress["of"]) if view.progress.get("of") else 0.0


def _replace_watch(root: Path | None) -> None:
    global _watch
    if _watch is not None:
        _watch.end()
    _accepted.clear()
    _watch = Watch(root, _memory())


def _memory() -> Path:
    return Path(bpy.utils.extension_path_user(extension.NAME, create=True)) / "batches.json"


def _remember(roots: Iterable[Path]) -> None:
    # a folder that cannot be written: it is found no more when Blender was closed
    with contextlib.suppress(Problem, OSError, ValueError):
        write_json(_memory(), [str(root) for root in roots][:MOST_ROWS])


def register():
    pass


def unregister():
    """The batch goes on: only the looking ends."""
    global _watch, _shown
    if _watch is not None:
        _watch.end()
    _watch, _shown = None, ()
    _accepted.clear()
