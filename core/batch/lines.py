# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch as tasks for another scheduler: their names, dependencies and commands. Standard library only."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

from .groups import GATE, GROUPS, group_named
from .record import Batch, BatchFace
from .state import DONE, WAITING, derive_state, waits
from .task import ROOT

PARTS = ("all", "to the masks", "from the masks")
"""Values of the Flamenco job's setting `part`, as in farm/flamenco/wildcap.js."""


@dataclass(frozen=True)
class BatchTask:
    """A command, `words`, which runs in any folder once the task named `after` ('': none) has succeeded."""

    face: str
    group: str
    after: str
    words: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.face}.{self.group}"

    def line(self) -> str:
        """Return the name, the dependency and the shell command, separated by tabs."""
        return f"{self.name}\t{self.after}\t{shlex.join(self.words)}"


def list_tasks(batch: Batch, python: str = sys.executable, root: Path = ROOT) -> list[BatchTask]:
    """Return the remaining tasks in a valid order, without those behind a mask that has not been accepted.

    `python` and `root`, WildCap's folder, are those of the machines that will run the tasks.
    """
    program = (python, str(root), "batch", "task", str(batch.root))
    return [task for face in batch.faces for task in _tasks_of_face(batch, face, program)]


def _tasks_of_face(batch: Batch, face: BatchFace, program: tuple[str, ...]) -> list[BatchTask]:
    state = derive_state(batch, face)
    if state.state in (DONE, WAITING) or state.group is None:
        return []
    tasks: list[BatchTask] = []
    for group in GROUPS[GROUPS.index(state.group) :]:
        if waits(batch, face, group):
            break
        after = tasks[-1].name if tasks else ""
        tasks.append(BatchTask(face.name, group.name, after, (*program, face.name, group.name)))
    return tasks


def list_flamenco_jobs(batch: Batch) -> list[dict]:
    """Return a job for each face with remaining tasks, in the form of Flamenco's API (SubmittedJob).

    Flamenco ends a whole job when much of it fails, hence one job per face.
    """
    remaining: dict[str, list[int]] = {}
    for task in list_tasks(batch):
        remaining.setdefault(task.face, []).append(GROUPS.index(group_named(task.group)))
    gate, platform = GROUPS.index(group_named(GATE)), {"win32": "windows"}.get(sys.platform, sys.platform)
    jobs = []
    for face, indices in remaining.items():
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
