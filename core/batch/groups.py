# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tasks of a face: groups of stages that run on one machine in one go, with what they need of it. Standard library
only."""

from __future__ import annotations

from dataclasses import dataclass

from ..capture import stages
from ..capture.messages import Problem
from ..capture.stages import MASK_STAGE, NAMES, Stage

GATE = "solve"
"""The group that a batch with an artist's gate begins only when the artist has looked at the mask."""
DELIVER = "deliver"


@dataclass(frozen=True)
class StageGroup:
    """`first` and `last` name its stages; `memory_gb` is what a machine should have free for it (the largest stage of
    the table of costs, rounded up); `on_device` says that a GPU helps."""

    name: str
    label: str
    first: str
    last: str
    memory_gb: float
    on_device: bool = False

    @property
    def stages(self) -> tuple[Stage, ...]:
        return stages.STAGES[NAMES.index(self.first) : NAMES.index(self.last) + 1]


GROUPS = (
    StageGroup("head", "Head", "frames", "registration", 2.0),
    StageGroup("mask", "Mask", "delight", MASK_STAGE, 3.0, on_device=True),
    StageGroup(GATE, "Solve", "solve", "upscale", 5.0, on_device=True),
    StageGroup(DELIVER, "Deliver", "transfer", "transfer", 2.0),
)
"""In their order; each begins where the one before has ended."""


def group_named(name: str) -> StageGroup:
    """Raises Problem for an unknown name."""
    for group in GROUPS:
        if group.name == name:
            return group
    raise Problem(
        f"There is no task named {name!r}.", f"The tasks of a face are {', '.join(group.name for group in GROUPS)}."
    )
