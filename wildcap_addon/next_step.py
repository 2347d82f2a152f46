# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What to click next: one function from facts to a step. Knows no bpy, so that every state can be tested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..core.capture import stages
from ..core.capture.freshness import FINISHED

if TYPE_CHECKING:
    from .status import Status


@dataclass(frozen=True)
class Facts:
    """What the decision depends on. `status` None: no capture, or not looked at yet."""

    has_capture: bool = False
    has_python: bool = False
    running: str = ""  # what the capture's job is doing, a word of WORDS; '' for nothing
    painting: bool = False
    head_time: float = -1.0  # modification time of the head.obj that is in the scene; -1: none
    maps_time: float = -1.0  # of the maps that the material shows; -1: none assembled
    status: Status | None = None


@dataclass(frozen=True)
class NextStep:
    """One line of state, the large button below it (operator '' for none), and a small one for another way: (label,
    operator, icon)."""

    state: str
    label: str
    operator: str
    icon: str
    alternative: tuple[str, str, str] = ()


BEFORE_MASK = stages.NAMES[: stages.NAMES.index(stages.MASK_STAGE) + 1]
SET_UP = NextStep("The solver is not set up on this machine.", "Install Solver", "wildcap.install_solver", 'IMPORT')
ASK = NextStep(
    "SwitchLight waits for your consent. Nothing was sent.", "Allow Sending", "wildcap.allow_sending", 'LOCKED'
)
MAKE = ("Make My Head", "wildcap.make_my_head", 'USER')
WORDS = {
    "make": "Making your head ...",
    "reconstruct": "Reconstructing ...",
    "solve": "Solving ...",
    "tool": "Looking at the texture ...",
    "deliver": "Writing the maps ...",
    "wait": "Waiting for the job of another face ...",
    "install": "Installing the solver ...",
    "ask": "One moment ...",
    "test": "Testing the solver ...",
    "batch": "A batch or another Blender is working on this face ...",
}


def next_step(facts: Facts, translated: Callable[[str], str] = str) -> NextStep:
    """The one thing to do now. A stale stage never drags the artist back before the mask; its row says so. `translated`
    is for the sentences that names are put into; all others are translated as they are shown."""
    if facts.painting:
        return NextStep(
            "Red is shadow, green is protected. Paint adds, Ctrl takes away.",
            "Save Mask and Leave",
            "wildcap.finish_mask",
            'CHECKMARK',
        )
    if facts.running == "batch":
        return NextStep(WORDS["batch"], "Cancel Batch", "wildcap.cancel_batch", 'CANCEL')
    if facts.running:
        return NextStep(WORDS[facts.running], "Cancel", "wildcap.cancel", 'CANCEL')
    if not facts.has_capture:
        return (
            NextStep("No face yet.", "Choose Video", "wildcap.choose_video", 'FILE_MOVIE')
            if facts.has_python
            else SET_UP
        )
    status = facts.status
    if status is None:
        return NextStep("Looking at the capture ...", "", "", 'TIME')
    if status.missing:
        return NextStep(
            "The folder of this capture is not where it was.", "Locate Capture", "wildcap.locate_capture", 'VIEWZOOM'
        )
    if status.problem is not None:
        return NextStep("This capture cannot be used.", "Choose Video", "wildcap.choose_video", 'FILE_MOVIE')
    return _step_of(facts, status, translated)


def _step_of(facts: Facts, status: Status, translated: Callable[[str], str]) -> NextStep:
    # A capture without a source (the sample head) came finished up to its mask; there is nothing to reconstruct it
    # from.
    missing = (
        [name for name in BEFORE_MASK if status.stages[name] == "to do"] if status.source or not status.has_head else []
    )
    if missing and not status.source:
        return NextStep("This capture has no video yet.", "Choose Video", "wildcap.choose_video", 'FILE_MOVIE')
    if (
        missing[:1] == ["delight"]
        and status.sending
        and status.sending.frames
        and not status.agreed
        and facts.has_python
    ):
        return ASK
    if missing:
        begun = len(missing) < len(BEFORE_MASK)
        state = (
            translated("Stopped before {}.").format(translated(stages.by_name(missing[0]).label))
            if begun
            else "The video is chosen."
        )
        by_hand = ("Continue Reconstruction" if begun else "Reconstruct", "wildcap.reconstruct", 'MESH_MONKEY')
        if not facts.has_python:
            return SET_UP
        return NextStep(state, *by_hand, alternative=MAKE) if begun else NextStep(state, *MAKE, alternative=by_hand)
    if facts.head_time < status.head_time:
        return NextStep("The head is ready.", "Bring In Head", "wildcap.bring_in_head", 'IMPORT')
    solved = status.has_maps and status.stages["solve"] in (*FINISHED, "absent")
    if not solved and status.interrupted:
        words = "A solve was interrupted. It goes on from its last checkpoint, unless the settings changed."
        step = NextStep(words, "Continue Solving", "wildcap.solve", 'LIGHT')
        return step if facts.has_python else SET_UP
    if not solved and not status.has_mask:
        accept = ("Accept Proposal", "wildcap.accept_proposal", 'CHECKMARK') if facts.has_python else ()
        return NextStep(
            "Check the shadow mask, then Solve.", "Check Shadow Mask", "wildcap.paint_mask", 'BRUSH_DATA', accept
        )
    if not solved:
        state = (
            "The mask or the settings changed since the last solve."
            if status.stages["solve"] == "stale"
            else "The shadow mask is painted."
        )
        return NextStep(state, "Solve", "wildcap.solve", 'LIGHT') if facts.has_python else SET_UP
    if facts.maps_time < status.maps_time:
        return NextStep("The maps are ready.", "Assemble Material", "wildcap.assemble_material", 'MATERIAL')
    state = translated("Rendered to renders/{}.").format(status.render) if status.render else "The head can be relit."
    return NextStep(state, "Render", "wildcap.render", 'RENDER_STILL')
