# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batch shown in the tab: many faces processed outside Blender, by another process or a farm.

Progress is stored in the captures. A thread reads them, `poll` takes over what it found, panels read only that. The
extension's user folder remembers the batches, so that Blender finds them again after a restart. Run-time state only.
"""

import contextlib
from collections.abc import Iterable
from pathlib import Path

from bpy.app.translations import pgettext_iface as iface_

from ..core.batch import gate
from ..core.batch.groups import GATE, group_named
from ..core.batch.record import BatchFace
from ..core.batch.state import DONE, STOPPED, TO_DO, WAITING, WORKING, FaceState
from ..core.capture.files import write_json
from ..core.capture.messages import Problem
from . import captures
from .batch_watch import BatchView, Watch, remembered
from .extension import user_file

MOST_ROWS = 10
"""Number of batches to remember."""
MEMORY = "batches.json"
ICONS = {DONE: 'CHECKMARK', TO_DO: 'RADIOBUT_OFF', WORKING: 'PLAY', WAITING: 'BRUSH_DATA', STOPPED: 'ERROR'}
_watch: Watch | None = None
_shown: tuple = ()
_accepted: set[str] = set()  # captures whose mask was accepted since their last look


def current() -> Path | None:
    """Return the folder of the open batch."""
    return _watch.root if _watch is not None else None


def view() -> BatchView:
    """Return what is known of the open batch; empty before the first look."""
    return _watch.view if current() else BatchView()


def choose(root: Path) -> None:
    """Open a batch, and remember it."""
    memory = user_file(MEMORY)
    _remember([root, *(other for other in remembered(memory) if other != root)])
    if current() != root:
        _replace_watch(root)


def close() -> None:
    """Close the open batch, and forget it."""
    _remember(other for other in remembered(user_file(MEMORY)) if other != current())
    _replace_watch(None)


def state_of(root: str) -> FaceState | None:
    """Return the state of a capture that belongs to the batch."""
    face = view().face(root)
    face_state = view().states.get(face.name) if face else None
    if face_state is not None and face_state.state == WAITING and root in _accepted:
        return FaceState(TO_DO, group_named(GATE))
    return face_state


def works_on(root: str) -> bool:
    """Return whether the batch, or somebody else, is working on one of its captures."""
    face, face_state = view().face(root), state_of(root)
    return face is not None and (
        face.name in view().progress.get("working", {}) or face_state is not None and face_state.state == WORKING
    )


def waiting() -> list[BatchFace]:
    """Return the faces whose masks wait for approval, in the batch's order."""
    return [face for face, face_state in _states() if face_state.state == WAITING]


def ready() -> int:
    """Count the faces to solve whose masks were approved."""
    return sum(each.state == TO_DO and each.group is not None and each.group.name == GATE for _, each in _states())


def accept(face: BatchFace) -> None:
    """Approve a face's mask as it is. Raises Problem if there is none."""
    gate.accept_mask(face.capture)
    _accepted.add(str(face.root))


def poll() -> bool:
    """Take over what the thread found, and return whether the tab changed. Tests call it in place of the timer."""
    global _shown
    if _watch is None:
        _replace_watch(None)
    _watch.listed = frozenset(map(captures.root, captures.listed()))
    if _watch.root is None and _watch.found is not None:
        choose(_watch.found)
    batch_view = view()
    for root in list(_accepted):
        face = batch_view.face(root)
        if face is None or face.name in batch_view.states and batch_view.states[face.name].state != WAITING:
            _accepted.discard(root)
    before = _shown
    _shown = (
        current(),
        batch_view.states,
        batch_view.runner,
        bool(batch_view.problem),
        line(batch_view),
        share(batch_view),
        frozenset(_accepted),
    )
    return before != _shown


def line(view: BatchView) -> str:
    """Describe the current work: 'Anna: Cameras 40 %, about 20 min left'; '' if unknown."""
    words = [
        iface_("{}: {} {}").format(name, iface_(each["stage"]), f"{each['share']:.0%}")
        for name, each in view.progress.get("working", {}).items()
    ][:3]
    if view.progress.get("left_s") is not None:
        words.append(iface_("about {} min left").format(max(1, round(view.progress["left_s"] / 60))))
    return ", ".join(words)


def share(view: BatchView) -> float:
    """Return the share of the run's faces that have ended, in [0, 1]."""
    return min(1.0, view.progress["ended"] / view.progress["of"]) if view.progress.get("of") else 0.0


def _states() -> list[tuple[BatchFace, FaceState]]:
    faces = view().batch.faces if view().batch else ()
    return [(face, face_state) for face in faces if (face_state := state_of(str(face.root)))]


def _replace_watch(root: Path | None) -> None:
    global _watch
    if _watch is not None:
        _watch.end()
    _accepted.clear()
    _watch = Watch(root, user_file(MEMORY))


def _remember(roots: Iterable[Path]) -> None:
    # without a writable folder the batch is not found after a restart
    with contextlib.suppress(Problem, OSError, ValueError):
        write_json(user_file(MEMORY), [str(root) for root in roots][:MOST_ROWS])


def register():
    pass


def unregister():
    """Stop watching; the batch itself goes on."""
    global _watch, _shown
    if _watch is not None:
        _watch.end()
    _watch, _shown = None, ()
    _accepted.clear()
