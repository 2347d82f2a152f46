# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Next step: one function from facts to a button. Independent of bpy, so that every state can be tested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..core.capture import stages
from ..core.capture.freshness import FINISHED

if TYPE_CHECKING:
    from .status import Status


@dataclass(frozen=True)
class Facts:
    """Input of the decision; `status` is None without a capture, or before its first look."""

    has_capture: bool = False
    has_python: bool = False
    running: str = ""  # kind of the capture's job, a key of WORDS; '' for none
    painting: str = ""  # what is painted: SHADOW, PROTECT or LAYER; '' for nothing
    head_time: float = -1.0  # modification time of the head.obj in the scene; -1: none
    maps_time: float = -1.0  # of the material's maps; -1: none assembled
    status: Status | None = None
    asks_tone: bool = False  # the estimated skin tone is unsure, and none was chosen


@dataclass(frozen=True)
class NextStep:
    """Line of state, the large button below it ('' for no operator), and a small one (label, operator, icon)."""

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
PAINTING = NextStep(
    "Red is shadow, green is protected. Paint adds, Ctrl takes away.",
    "Save Mask and Leave",
    "wildcap.finish_mask",
    'CHECKMARK',
)
PAINTING_LAYER = NextStep(
    "What you paint lies over the map, which stays. Heal replaces it by skin.",
    "Save Layer and Leave",
    "wildcap.finish_mask",
    'CHECKMARK',
)
LOCATE = NextStep(
    "The folder of this capture is not where it was.", "Locate Capture", "wildcap.locate_capture", 'VIEWZOOM'
)
ASK_TONE = "The film does not tell the skin tone well: choose a swatch under Skin Tone."
MAKE = ("Make My Head", "wildcap.make_my_head", 'USER')
CHOOSE = ("Choose Video", "wildcap.choose_video", 'FILE_MOVIE')
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
    """Return the one thing to do now. `translated` is for templates; whole sentences are translated when drawn.

    Stale stages before the mask do not lead back to Reconstruct; their rows show it.
    """
    if facts.painting:
        return PAINTING_LAYER if facts.painting == 'LAYER' else PAINTING
    if facts.running == "batch":
        return NextStep(WORDS["batch"], "Cancel Batch", "wildcap.cancel_batch", 'CANCEL')
    if facts.running:
        return NextStep(WORDS[facts.running], "Cancel", "wildcap.cancel", 'CANCEL')
    if not facts.has_capture:
        return NextStep("No face yet.", *CHOOSE) if facts.has_python else SET_UP
    status = facts.status
    if status is None:
        return NextStep("Looking at the capture ...", "", "", 'TIME')
    if status.missing:
        return LOCATE
    if status.problem is not None:
        return NextStep("This capture cannot be used.", *CHOOSE)
    return _continue(facts, status, translated)


def _continue(facts: Facts, status: Status, translated: Callable[[str], str]) -> NextStep:
    # The sample head has no source; it comes finished up to its mask.
    to_do = [name for name in BEFORE_MASK if status.stages[name] == "to do"]
    if to_do and (status.source or not status.has_head):
        return _reconstruct(facts, status, to_do, translated)
    step = _finish(facts, status, translated)
    return replace(step, state=ASK_TONE) if facts.asks_tone else step


def _finish(facts: Facts, status: Status, translated: Callable[[str], str]) -> NextStep:
    if facts.head_time < status.head_time:
        return NextStep("The head is ready.", "Bring In Head", "wildcap.bring_in_head", 'IMPORT')
    if not status.has_maps or status.stages["solve"] not in (*FINISHED, "absent"):
        return _solve(facts, status)
    if facts.maps_time < status.maps_time:
        return NextStep("The maps are ready.", "Assemble Material", "wildcap.assemble_material", 'MATERIAL')
    state = translated("Rendered to renders/{}.").format(status.render) if status.render else "The head can be relit."
    return NextStep(state, "Render", "wildcap.render", 'RENDER_STILL')


def _reconstruct(facts: Facts, status: Status, to_do: list[str], translated: Callable[[str], str]) -> NextStep:
    if not status.source:
        return NextStep("This capture has no video yet.", *CHOOSE)
    if not facts.has_python:
        return SET_UP
    if to_do[0] == "delight" and status.sending and status.sending.frames and not status.agreed:
        return ASK
    reconstruct = ("wildcap.reconstruct", 'MESH_MONKEY')
    if len(to_do) == len(BEFORE_MASK):
        return NextStep("The video is chosen.", *MAKE, alternative=("Reconstruct", *reconstruct))
    state = translated("Stopped before {}.").format(translated(stages.by_name(to_do[0]).label))
    return NextStep(state, "Continue Reconstruction", *reconstruct, alternative=MAKE)


def _solve(facts: Facts, status: Status) -> NextStep:
    if not status.interrupted and not status.has_mask:
        accept = ("Accept Proposal", "wildcap.accept_proposal", 'CHECKMARK') if facts.has_python else ()
        return NextStep(
            "Check the shadow mask, then Solve.", "Check Shadow Mask", "wildcap.paint_mask", 'BRUSH_DATA', accept
        )
    if not facts.has_python:
        return SET_UP
    if status.interrupted:
        state = "A solve was interrupted. It goes on from its last checkpoint, unless the settings changed."
        return NextStep(state, "Continue Solving", "wildcap.solve", 'LIGHT')
    if status.stages["solve"] == "stale":
        return NextStep("The mask or the settings changed since the last solve.", "Solve", "wildcap.solve", 'LIGHT')
    return NextStep("The shadow mask is painted.", "Solve", "wildcap.solve", 'LIGHT')
