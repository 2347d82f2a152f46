# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch as tasks for somebody else's scheduler: what each is called, what it waits for, and the command that does it.
Standard library only."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

from .groups import GATE, GROUPS, group_named
from .record import Batch
from .state import DONE, WAITING, FaceState, derive_state, waits
from .task import ROOT

PARTS = ("all", "to the masks", "from the masks")
"""What of each face a job of Flamenco's does, in the words of farm/flamenco/wildcap.js."""


@dataclass(frozen=True)
class BatchTask:
    """`after` names the task that must have ended well before, '' for none; `words` is the command, which runs in any
    folder."""

    face: str
    group: str
    after: str
    words: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.face}.{self.group}"

    def line(self) -> str:
        """Name, what it waits for, and the shell's line, with tabs between."""
        return f"{self.name}\t{self.after}\t{shlex.join(self.words)}"


def list_tasks(batch: Batch, python: str = sys.executable, root: Path = ROOT) -> list[BatchTask]:
    """Every task that is left to do, in an order in which they could be done one by one; none beyond a mask that still
    has to be looked at. `python` and `root`, WildCap's folder, are those of the machines that will run them."""
    return [
        task
        for face in batch.faces
        for task in _of_face(batch, face.name, derive_state(batch, face), (python, str(root)))
    ]


def _of_face(batch: Batch, name: str, state: FaceState, program: tuple[str, str]) -> list[BatchTask]:
    if state.state in (DONE, WAITING) or state.group is None:
        return []
    tasks: list[BatchTask] = []
    for group in GROUPS[GROUPS.index(state.group) :]:
        if waits(batch, batch.face(name), group):
            break
        tasks.append(
            BatchTask(
                name,
                group.name,
                tasks[-1].name if tasks else "",
                (*program, "batch", "task", str(batch.root), name, group.name),
            )
        )
    return tasks


def list_flamenco_jobs(batch: Batch) -> list[dict]:
    """A job for each face that has tasks left, as Flamenco's API takes one (its SubmittedJob). One each, for Flamenco
    ends a whole job when much of it fails, and one face's film is no reason to end the others."""
    left: dict[str, list[int]] = {}
    for task in list_tasks(batch):
        left.setdefault(task.face, []).append(GROUPS.index(group_named(task.group)))
    gate, platform = GROUPS.index(group_named(GATE)), {"win32": "windows"}.get(sys.platform, sys.platform)
    jobs = []
    for face, indices in left.items():
        part = PARTS[1] if indices[-1] < gate else PARTS[2] if indices[0] >= gate else PARTS[0]
        jobs.append(
            {
                "name": f"WildCap {face}",
                "type": "wildcap",
                "priority": 50,
                "submitter_platform": platform,
                "settings": {"batch": str(batch.root), "faces": face, "part": part},
            }
        )
    return jobs
