# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tasks of a face: groups of stages that run in one go on one machine. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass

from ..capture import stages
from ..capture.messages import Problem
from ..capture.stages import MASK_STAGE, NAMES, Stage

GATE = "solve"
"""Group that waits for the artist's review of the mask, if the batch has that gate."""
DELIVER = "deliver"


@dataclass(frozen=True)
class StageGroup:
    """Stages `first` to `last`, the free memory that the largest needs, and whether a GPU helps."""

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
    StageGroup(DELIVER, "Deliver", "retouch", "transfer", 3.0),
)


def group_named(name: str) -> StageGroup:
    """Return a group by its name. Raises Problem if there is none."""
    for group in GROUPS:
        if group.name == name:
            return group
    raise Problem(
        f"There is no task named {name!r}.", f"The tasks of a face are {', '.join(group.name for group in GROUPS)}."
    )


def groups_until(name: str | None) -> tuple[StageGroup, ...]:
    """Return the groups up to `name`, or all of them."""
    return GROUPS[: GROUPS.index(group_named(name)) + 1] if name else GROUPS
