# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a finished stage is still what its inputs, its settings and its code would give.

When a stage begins, `describe_conditions` says what its result will depend on; capture.json keeps that, and
`judge_stage` compares it with what is there now. What differs is told apart: inputs and settings are the artist's
doing, and such a stage is out of date; code that has changed is ours, and a stage that older code made stays as it is
until the artist has it run again. Standard library only.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from pathlib import Path

from ..settings.settings import Settings, result_paths, result_settings
from .code_key import code_key
from .hashes import hash_source, hash_tree, hash_value, same_source, sample_file
from .portable_paths import read_portable
from .stages import Stage
from .together import hash_told

TO_DO, DONE, STALE, OLDER = "to do", "done", "stale", "older"
FINISHED = (DONE, OLDER)
"""States of a stage whose outputs are what its inputs and settings ask for: painted on, delivered and rendered
alike."""
SOURCE = "the video or photographs"


@dataclass(frozen=True)
class Verdict:
    """`state`: 'to do', 'done', 'stale' (an input or a setting changed) or 'older' (neither did, but the code);
    `changed` names the inputs and settings that did; `version` is that of the WildCap that made the outputs."""

    state: str
    changed: tuple[str, ...] = ()
    version: str = ""

    def reason(self) -> str:
        """Why it is not simply done or to do: 'texture.exr changed'."""
        if self.state == OLDER:
            return f"made by older code (WildCap {self.version})"
        return f"{', '.join(self.changed)} changed" if self.changed else ""


def describe_conditions(root: Path, record: dict, stage: Stage, settings: Settings) -> dict:
    """All that the result of a stage depends on beside its settings.

    Parameters
    ----------
    root : the capture's folder
    record : capture.json's content
    stage : that is about to begin
    settings : for what they name outside of the capture

    Returns
    -------
    {"code", "inputs"}, as capture.json's entry of the stage keeps them.
    """
    return {"code": code_key(stage.module), "inputs": _hash_inputs(root, record, stage, settings)}


def judge_stage(root: Path, record: dict, stage: Stage, settings: Settings) -> Verdict:
    """The state of a stage whose outputs are there.

    Parameters
    ----------
    root : the capture's folder
    record : capture.json's content
    stage : that is asked about
    settings : as they are now
    """
    finished = record["stages"].get(stage.name)
    if finished is None:
        return Verdict(TO_DO)
    version = finished["version"]
    changed = [
        *_changed_inputs(finished["inputs"], root, record, stage, settings),
        *_changed_settings(finished, stage, settings),
    ]
    if changed:
        return Verdict(STALE, tuple(changed), version)
    return Verdict(DONE if finished["code"] == code_key(stage.module) else OLDER, version=version)


def _hash_inputs(root: Path, record: dict, stage: Stage, settings: Settings) -> dict:
    """Content hash by name: of the capture's files that the stage reads, of what its settings name elsewhere, and of
    the source for the first stage."""
    names = (
        *stage.reads,
        *stage.optional_reads,
        *(("own_head.obj", "own_head.json") if stage.name == "solve" and settings.solve.prior else ()),
    )
    hashes = {name: _digest(hash_tree(root / name)) for name in names}
    hashes |= {
        f"{stage.name}.{name}": _digest(_hash_place(name, path))
        for name, path in result_paths(getattr(settings, stage.name)).items()
    }
    if not stage.reads:
        hashes[SOURCE] = record.get("source_stamp", [])
    return hashes


def _hash_place(name: str, path: str) -> dict[str, str] | str:
    """Of what a setting names outside of the capture; of another capture only what a solve reads of it counts."""
    return hash_told(path) if name == "together" else hash_tree(Path(path), sample_file)


def _other_source(recorded: list, root: Path, record: dict) -> bool:
    """Whether the source is there and holds something else than what was recorded of it."""
    present = hash_source(source_of(root, record))
    return bool(present) and not same_source(recorded, present)


def source_of(root: Path, record: dict) -> Path | None:
    """Where the video or the folder of photographs is, or was."""
    return read_portable(record["source"], root) if record.get("source") else None


def _changed_inputs(recorded: dict, root: Path, record: dict, stage: Stage, settings: Settings) -> list[str]:
    present = _hash_inputs(root, record, stage, settings)
    # by settings, outside of the capture
    named = {name for name in {*present, *recorded} if name.startswith(f"{stage.name}.")}
    gone = {
        f"{stage.name}.{name}"
        for name, path in result_paths(getattr(settings, stage.name)).items()
        if not Path(path).exists()
    }
    changed = [name for name in present.keys() & recorded.keys() - gone - {SOURCE} if present[name] != recorded[name]]
    changed += [name for name in named if name not in present or name not in recorded]
    if SOURCE in present and _other_source(recorded.get(SOURCE, []), root, record):
        changed.append(SOURCE)
    return sorted(changed)


def _changed_settings(finished: dict, stage: Stage, settings: Settings) -> list[str]:
    """A setting that the record does not know had its default; one that names a path is judged by what the path
    holds."""
    chosen = getattr(settings, stage.name)
    then = {**asdict(type(chosen)()), **finished["settings"]}
    paths = {f.name for f in fields(chosen) if "path" in f.metadata}
    changed = [
        f"{stage.name}.{name}"
        for name, value in result_settings(chosen).items()
        if name not in paths and then[name] != value
    ]
    # what another one has made, here or on another machine, is as good
    any_device = {"device"} if settings.device == "auto" else set()
    return changed + [
        name for name in stage.shared if name not in any_device and finished[name] != getattr(settings, name)
    ]


def _digest(tree: str | dict) -> str:
    """One hash for a folder's many; '' stays what it is: nothing there."""
    return hash_value(tree) if isinstance(tree, dict) else tree
