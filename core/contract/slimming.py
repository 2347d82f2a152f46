# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A finished face is slimmed: what its video gives again in a minute goes, and counts as if it were there (slimmed.py).
Standard library only.

First a list of all that would go, then exactly that; and of it only what WildCap wrote and nobody changed
(ownership.py). When a stage has to run that reads what went, the worker has it made again first (worker/runner.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .. import __version__
from . import ownership, slimmed, stages
from .capture import Capture
from .deletion import GROUPS, megabytes
from .files import storage_problem
from .freshness import FINISHED, OLDER
from .hashes import hash_tree
from .messages import Problem
from .settings import Settings, result_paths


@dataclass(frozen=True)
class Slimming:
    """What slimming a capture does: the files that go (path in the capture -> size), the hashes to keep (stage ->
    {name: tree}), whole sentences on what stays that could have gone, and on what to know of what goes."""

    going: dict[str, int]
    hashes: dict[str, dict]
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        return sum(self.going.values())


def plan(capture: Capture, settings: Settings) -> Slimming:
    """Looks at a capture; `settings` decide which stages count as finished. Raises Problem where it is none, cannot be
    read, is not finished to its last stage, or has lost the video that all of it was made from."""
    if not capture.json.is_file():
        raise Problem(
            f"There is no capture at {capture.root}.", "Check the name: a capture's folder holds capture.json."
        )
    verdicts = {stage.name: capture.verdict(stage, settings) for stage in stages.STAGES}
    for stage in stages.STAGES:
        verdict = verdicts[stage.name]
        if verdict.state not in FINISHED:
            words = f"out of date: {verdict.reason()}" if verdict.reason() else "still to do"
            raise Problem(
                f"{capture.root.stem} is not finished: the stage {stage.label} is {words}.",
                f"Run the chain to its end first: `python -m core run - {capture.root}`.",
            )
    capture.require_source()
    going, hashes, notes, older, record = {}, {}, [], [], capture.read()
    for name in stages.SLIMMED:
        stage = next(stage for stage in stages.STAGES if name in stage.writes)
        try:
            files = [path for path in ownership.files_in(capture.root / name) if not path.name.startswith(".")]
            theirs = [path for path in files if not ownership.is_ours(capture.root, path)]
            sizes = {
                ownership.path_inside(capture.root, path): path.lstat().st_size for path in files if path not in theirs
            }
        except OSError as error:
            raise storage_problem(error, capture.root) from error
        gone = name in slimmed.hashes_of(record)
        if reason := "" if gone else _obstacle(capture, stage, settings, theirs):
            notes.append(f"{name} stays: {reason}.")
            continue
        if not gone:
            hashes[stage.name] = {name: hash_tree(capture.root / name)}
        going |= sizes
        older += [stage.label] if sizes and verdicts[stage.name].state == OLDER else []
    if older:
        notes.append(
            f"Made by older code: {', '.join(older)}. Made again by WildCap {__version__} they may differ, "
            "and what was made from them is then out "
            "of date."
        )
    return Slimming(going, hashes, tuple(notes))


def _obstacle(capture: Capture, stage: stages.Stage, settings: Settings, theirs: list[Path]) -> str:
    """Why what a stage wrote could not be made again as it is; '' where it can."""
    if theirs:
        return f"{ownership.path_inside(capture.root, theirs[0])} is not as WildCap wrote it"
    if result_paths(getattr(settings, stage.name)):
        return "it was made from files outside of the capture, which may not be there any more when it is needed"
    if stage.name == "delight" and settings.delight.delighter == "switchlight":
        return "it was paid for"
    return ""


def slim(capture: Capture, settings: Settings) -> Slimming:
    """Slims a capture and returns what went. Killed in the middle it can be asked for again: what goes is on record
    before the first file does. Raises Problem as `plan` does, and where a worker is at the capture or a file cannot be
    deleted."""
    plan(capture, settings)  # before the lock makes a capture of what is none
    with capture.locked():
        removal = plan(capture, settings)
        if removal.hashes:
            capture.keep_hashes(removal.hashes)
        try:
            for inside in removal.going:
                (capture.root / inside).unlink(missing_ok=True)
            for name in stages.SLIMMED:
                if name in slimmed.hashes_of(capture.read()):
                    ownership.remove_empty_folders(capture.root / name)
        except OSError as error:
            raise storage_problem(error, capture.root) from error
    return removal


def lines(slimming: Slimming, capture: Capture) -> list[str]:
    """The list as sentences."""
    kinds: dict[str, list[int]] = {}
    for inside, size in slimming.going.items():
        kinds.setdefault(GROUPS[inside.partition("/")[0]], []).append(size)
    said = [f"{label}: {len(sizes)} files, {megabytes(sum(sizes))}" for label, sizes in kinds.items()] or [
        "Nothing is left that could go."
    ]
    if slimming.going:
        left = sum(
            path.lstat().st_size
            for path in ownership.files_in(capture.root)
            if ownership.path_inside(capture.root, path) not in slimming.going
        )
        said.append(
            f"{megabytes(left)} stay: maps, masks, landmarks, head, renders, deliveries and the report among "
            "them. What goes is made again from the "
            "video when a stage needs it; keep the video."
        )
    return [*said, *slimming.notes]
