# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch as tasks for somebody else's scheduler: what each is called, what it waits for, and the command that does it. Standard library only."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass

from .groups import GROUPS
from .record import Batch
from .state import DONE, WAITING, State, look, waits


@dataclass(frozen=True)
class Task:
    """`name` is FACE.GROUP; `after` names the task that must have ended well before, '' for none; `words` is the command, from the folder that holds core/."""

    name: str
    after: str
    words: tuple[str, ...]

    def line(self) -> str:
        """Name, what it waits for, and the shell's line, with tabs between."""
        return f"{self.name}\t{self.after}\t{shlex.join(self.words)}"


def list_tasks(batch: Batch, python: str = sys.executable) -> list[Task]:
    """Every task that is left to do, in an order in which they could be done one by one; none beyond a mask that still has to be looked at."""
    return [task for face in batch.faces for task in _of_face(batch, face.name, look(batch, face), python)]


def _of_face(batch: Batch, name: str, state: State, python: str) -> list[Task]:
    if state.state in (DONE, WAITING) or state.group is None:
        return []
    found: list[Task] = []
    for group in GROUPS[GROUPS.index(state.group):]:
        if waits(batch, batch.face(name), group):
            break
        words = (python, "-m", "core", "batch", "task", str(batch.root), name, group.name)
        found.append(Task(f"{name}.{group.name}", found[-1].name if found else "", words))
    return found
