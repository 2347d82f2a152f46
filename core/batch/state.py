# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a face of a batch is, derived from its capture's own record each time it is asked. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..capture import delivery_plan, lease
from ..capture.capture import Capture
from ..capture.files import storage_problem
from ..capture.freshness import FINISHED
from ..capture.json_files import read_json
from ..capture.messages import Problem
from ..settings.settings import from_json, to_json
from .gate import is_accepted
from .groups import DELIVER, GATE, GROUPS, StageGroup
from .record import Batch, BatchFace

DONE, TO_DO, WORKING, WAITING, STOPPED = "done", "to do", "working", "waiting", "stopped"
SHEET = "contact_sheet.png"


@dataclass(frozen=True)
class FaceState:
    """`state` is one of the five; `group` is the task that is next, or that works or has stopped, None where all are
    done; `problem` and `remedy` say why it stopped; `machine` names the machine that works on it."""

    state: str
    group: StageGroup | None = None
    problem: str = ""
    remedy: str = ""
    machine: str = ""

    def words(self) -> str:
        """For a line of a list."""
        if self.state == DONE:
            return "done"
        label = self.group.label.lower() if self.group else ""
        return {
            TO_DO: f"{label} is next",
            WORKING: f"{label}: working on {self.machine}",
            WAITING: "its shadow mask waits to be looked at",
            STOPPED: f"{label} stopped: {self.problem} {self.remedy}",
        }[self.state]


def derive_state(batch: Batch, face: BatchFace) -> FaceState:
    """Where a face is. A record that cannot be read counts as stopped."""
    try:
        capture = face.capture
        group = next((group for group in GROUPS if not is_done(batch, face, group)), None)
        holder = lease.present_holder(capture.lock) if capture.root.is_dir() else None
        if holder is not None:
            return FaceState(
                WORKING, group or GROUPS[-1], machine=str(holder.get("host", "another machine")).partition("/")[0]
            )
        if group is None:
            return FaceState(DONE)
        stopped = capture.read().get("stopped")
        if stopped and stopped["stage"] in {stage.name for stage in group.stages}:
            return FaceState(STOPPED, group, stopped["problem"], stopped["remedy"])
        return FaceState(WAITING if waits(batch, face, group) else TO_DO, group)
    except (Problem, OSError) as error:
        problem = error if isinstance(error, Problem) else storage_problem(error, face.root)
        return FaceState(STOPPED, GROUPS[0], problem.problem, problem.remedy)


def waits(batch: Batch, face: BatchFace, group: StageGroup) -> bool:
    """Whether a task waits for the artist."""
    return group.name == GATE and batch.gate == "artist" and not is_accepted(face.capture)


def is_done(batch: Batch, face: BatchFace, group: StageGroup) -> bool:
    """Whether all stages of a task are finished as this batch asks for them; of the last one, whether it is delivered,
    too. Raises Problem."""
    settings = face.chosen()
    if not all(face.capture.state(stage, settings) in FINISHED for stage in group.stages):
        return False
    if group.name != DELIVER:
        return True
    delivered = batch.deliver is None or is_delivered(batch, face)
    return delivered and (not batch.blender or has_sheet(face.capture))


def deliver_settings(batch: Batch, face: BatchFace) -> dict:
    """The settings of a face with those of the delivery, as a job has them: with its mesh, which is OBJ where no
    Blender writes it. In a folder that all deliver to each face has one of its own: plain names may be alike where
    names are not (delivery_plan.safe_name)."""
    delivery = {"format": "obj", "whole": True, **(batch.deliver or {})}
    folder = {"folder": str(Path(delivery["folder"]) / face.name)} if delivery.get("folder") else {}
    return {**to_json(face.chosen()), "deliver": {**delivery, **folder}}


def is_delivered(batch: Batch, face: BatchFace) -> bool:
    """Whether the delivery that is asked for is there, whole, and made of the stages as they stand now. Raises Problem
    for settings that do not fit."""
    plan = delivery_plan.plan(face.capture, from_json(deliver_settings(batch, face)).deliver)
    try:
        told = read_json(plan.target / delivery_plan.PROVENANCE)
        made_of = {name: done["finished"] for name, done in told["stages"].items()}
        now = {name: done["finished"] for name, done in face.capture.read()["stages"].items()}
        return made_of == now and all((plan.target / name).is_file() for name in told["files"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def has_sheet(capture: Capture) -> bool:
    """Whether the contact sheet is there and not older than the maps that it shows."""

    def age(path: Path) -> float:
        return path.stat().st_mtime

    sheet, maps = capture.renders / SHEET, capture.maps_4k / "diffuse_albedo.png"
    return sheet.is_file() and maps.is_file() and age(sheet) >= age(maps)
