# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""State of a face in a batch, derived from its capture's record each time. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..capture import delivery_plan, lease, provenance, tone_choice
from ..capture.capture import Capture
from ..capture.files import storage_problem
from ..capture.freshness import FINISHED
from ..capture.json_files import read_json
from ..capture.messages import Problem
from ..capture.newest_maps import find_newest_maps
from ..settings.settings import from_json, to_json
from .gate import is_accepted
from .groups import DELIVER, GATE, GROUPS, StageGroup
from .record import Batch, BatchFace

DONE, TO_DO, WORKING, WAITING, STOPPED = "done", "to do", "working", "waiting", "stopped"
SHEET = "contact_sheet.png"


@dataclass(frozen=True)
class FaceState:
    """One of the five states, with its task (None if all are done), the problem that stopped it, and its machine."""

    state: str
    group: StageGroup | None = None
    problem: str = ""
    remedy: str = ""
    machine: str = ""

    def words(self) -> str:
        """Return the state for a line of a list."""
        label = self.group.label.lower() if self.group else ""
        return {
            DONE: "done",
            TO_DO: f"{label} is next",
            WORKING: f"{label}: working on {self.machine}",
            WAITING: "its shadow mask waits for review",
            STOPPED: f"{label} stopped: {self.problem} {self.remedy}",
        }[self.state]


def derive_state(batch: Batch, face: BatchFace) -> FaceState:
    """Return the state of a face; a record that cannot be read counts as stopped."""
    try:
        capture = face.capture
        group = next((group for group in GROUPS if not is_done(batch, face, group)), None)
        holder = lease.present_holder(capture.lock) if capture.root.is_dir() else None
        if holder is not None:
            machine = str(holder.get("host", "another machine")).partition("/")[0]
            return FaceState(WORKING, group or GROUPS[-1], machine=machine)
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
    """Return whether a task waits for the artist."""
    return group.name == GATE and batch.gate == "artist" and not is_accepted(face.capture)


def is_done(batch: Batch, face: BatchFace, group: StageGroup) -> bool:
    """Return whether a task's stages, and at the last its delivery, are as the batch wants them. Raises Problem."""
    settings = face.chosen()
    if not all(face.capture.state(stage, settings) in FINISHED for stage in group.stages):
        return False
    if group.name != DELIVER:
        return True
    delivered = batch.deliver is None or is_delivered(batch, face)
    return delivered and (not batch.blender or has_sheet(face.capture))


def deliver_settings(batch: Batch, face: BatchFace) -> dict:
    """Return the settings of a face's delivery, as a job has them.

    It includes the mesh, as OBJ, which needs no Blender. In a shared folder each face gets one of its own, because
    delivery_plan.safe_name may map two names to one.
    """
    delivery = {"format": "obj", "whole": True, **(batch.deliver or {})}
    if delivery.get("folder"):
        delivery["folder"] = str(Path(delivery["folder"]) / face.name)
    return {**to_json(face.chosen()), "deliver": delivery}


def is_delivered(batch: Batch, face: BatchFace) -> bool:
    """Return whether the delivery is complete, of the current stages and skin tone. Raises Problem."""
    settings = from_json(deliver_settings(batch, face))
    plan = delivery_plan.plan(face.capture, settings.deliver)
    try:
        delivered = read_json(plan.target / delivery_plan.PROVENANCE)
        made_from = {name: done["finished"] for name, done in delivered["stages"].items()}
        record = face.capture.read()
        now = {name: done["finished"] for name, done in record["stages"].items()}
        change = tone_choice.find_change(record, settings.solve.skin_tone)
        tone = provenance.describe_tone(change)
        return (
            made_from == now
            and delivered.get("skin_tone") == tone
            and all((plan.target / name).is_file() for name in delivered["files"])
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def has_sheet(capture: Capture) -> bool:
    """Return whether there is a contact sheet that is not older than the maps and the skin tone it shows."""
    sheet, maps = capture.renders / SHEET, find_newest_maps(capture)[0]
    shown = [maps, *(path for path in (capture.skin_tone,) if path.is_file())]
    return sheet.is_file() and maps.is_file() and sheet.stat().st_mtime >= max(path.stat().st_mtime for path in shown)
