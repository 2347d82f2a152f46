# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Judge whether a finished stage is still what its inputs, settings and code would give.

When a stage begins, capture.json records what its result depends on; `judge_stage` compares that with the present.
Changed inputs and settings are the artist's doing: the stage is stale. Changed code is ours: a stage made by older code
stays as it is until the artist runs it again.
"""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from ..settings.settings import Settings, result_paths, result_settings
from .code_key import code_key
from .hashes import hash_source, hash_tree, hash_value, same_source, sample_file
from .portable_paths import read_portable
from .retouch_layers import hash_shown
from .stages import RETOUCH, RETOUCHED, Stage
from .together import hash_inputs

TO_DO, DONE, STALE, OLDER = "to do", "done", "stale", "older"
FINISHED = (DONE, OLDER)
"""States in which a stage's outputs are used: painted on, delivered and rendered."""
SOURCE = "the video or photographs"


@dataclass(frozen=True)
class Verdict:
    """State of a stage, the inputs and settings that changed, and the version of WildCap that made its outputs."""

    state: str
    changed: tuple[str, ...] = ()
    version: str = ""

    def reason(self) -> str:
        """Explain a stale or older state: 'texture.exr changed'; '' for the others."""
        if self.state == OLDER:
            return f"made by older code (WildCap {self.version})"
        return f"{', '.join(self.changed)} changed" if self.changed else ""


def describe_conditions(root: Path, record: dict, stage: Stage, settings: Settings) -> dict:
    """Return {"code", "inputs"}: all that a stage's result depends on beside its settings.

    `record` is the content of capture.json in `root`; the settings may name inputs outside of the capture.
    """
    return {"code": code_key(stage.module), "inputs": _hash_inputs(root, record, stage, settings)}


def judge_stage(root: Path, record: dict, stage: Stage, settings: Settings) -> Verdict:
    """Judge a stage by its record, whether or not its outputs exist."""
    finished = record["stages"].get(stage.name)
    if finished is None:
        return Verdict(TO_DO if has_work(root, record, stage) else DONE)
    changed = [
        *_changed_inputs(finished["inputs"], root, record, stage, settings),
        *_changed_settings(finished, stage, settings),
    ]
    if changed:
        state = STALE
    else:
        state = DONE if finished["code"] == code_key(stage.module) else OLDER
    return Verdict(state, tuple(changed), finished["version"])


def has_work(root: Path, record: dict, stage: Stage) -> bool:
    """Return whether a stage has something to do: without the input that it works on, only to take back what it did."""
    if not stage.only_with or _hash_input(root, stage.only_with):
        return True
    did = record["stages"].get(stage.name, {}).get("inputs", {}).get(stage.only_with)
    return bool(did) or any((root / name).exists() for name in stage.writes)


def source_of(root: Path, record: dict) -> Path | None:
    """Return the recorded path of the video, the photograph or the folder of photographs."""
    return read_portable(record["source"], root) if record.get("source") else None


def _hash_inputs(root: Path, record: dict, stage: Stage, settings: Settings) -> dict:
    """Return the content hash of each input by name: files of the capture, places named by settings, and the source."""
    names = [*stage.reads, *stage.optional_reads]
    if stage.name == "solve" and settings.solve.prior:
        names += ["own_head.obj", "own_head.json"]
    hashes = {name: _hash_input(root, name) for name in names}
    for name, path in result_paths(getattr(settings, stage.name)).items():
        hashes[f"{stage.name}.{name}"] = hash_inputs(path) if name == "together" else hash_tree(Path(path), sample_file)
    # one hash for a folder's many; '' stays '': there is nothing
    digests = {name: hash_value(tree) if isinstance(tree, dict) else tree for name, tree in hashes.items()}
    return digests if stage.reads else {**digests, SOURCE: record.get("source_stamp", [])}


def _hash_input(root: Path, name: str) -> str | dict:
    """Return the content hash of a file, of each file of a folder, or of those layers that are shown; '' for none."""
    return hash_shown(root) if name == RETOUCH else hash_tree(root / name)


def _changed_inputs(recorded: dict, root: Path, record: dict, stage: Stage, settings: Settings) -> list[str]:
    present = _hash_inputs(root, record, stage, settings)
    places = result_paths(getattr(settings, stage.name))
    gone = {f"{stage.name}.{name}" for name, path in places.items() if not os.path.exists(path)}
    changed = [name for name in present.keys() & recorded.keys() - gone - {SOURCE} if present[name] != recorded[name]]
    # a setting that was emptied, or names a place since
    changed += [name for name in present.keys() ^ recorded.keys() if name.startswith(f"{stage.name}.")]
    # made before there were layers
    changed += [name for name in RETOUCHED if present.get(name) and name not in recorded]
    if SOURCE in present:
        source = hash_source(source_of(root, record))
        if source and not same_source(recorded.get(SOURCE, []), source):
            changed.append(SOURCE)
    return sorted(changed)


def _changed_settings(finished: dict, stage: Stage, settings: Settings) -> list[str]:
    """List the changed settings. One that is not recorded had its default; one that names a place is an input."""
    own = getattr(settings, stage.name)
    then = {**asdict(type(own)()), **finished["settings"]}
    paths = {f.name for f in fields(own) if "path" in f.metadata}
    changed = [
        f"{stage.name}.{name}"
        for name, value in result_settings(own).items()
        if name not in paths and then[name] != value
    ]
    for name in stage.shared:
        any_device = name == "device" and settings.device == "auto"  # another device's result is as good
        if not any_device and finished[name] != getattr(settings, name):
            changed.append(name)
    return changed
