# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""batch.json: the faces of a batch and what is wanted for each, not what has been done. Standard library only.

    {"format": 1, "gate": "automatic", "blender": "", "deliver": {}, "faces": [{"name", "source", "capture", "quality",
    "settings"}]}

Paths that travel with the batch's folder are relative to it (portable_paths.py), so machines may mount it anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..capture import tone_choice
from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.json_files import plain_name, read_json
from ..capture.messages import Problem
from ..capture.portable_paths import convert_settings, read_portable, write_portable
from ..settings.settings import Settings, from_json, preset

FORMAT = 1
NAME = "batch.json"
GATES = ("automatic", "artist")
"""Whether a face is solved with its proposed mask, or waits until the artist has accepted or painted one."""
PLAN_AGAIN = "Plan the batch again from its table: its captures keep what they have."


@dataclass(frozen=True)
class BatchFace:
    """A face with absolute paths of its source, a video or a folder of photographs, and of its capture.

    `settings` ({stage: {name: value}, seed, device}) lie over the preset `quality`.
    """

    name: str
    source: Path
    root: Path
    quality: str = "standard"
    settings: dict = field(default_factory=dict)

    @property
    def capture(self) -> Capture:
        return Capture(self.root)

    def wanted(self) -> dict:
        """Return its settings as a job has them, with the skin tone that was chosen since it was planned."""
        choice = tone_choice.read_choice(self.capture)
        if choice is None:
            return self.settings
        return {**self.settings, "solve": {**self.settings.get("solve", {}), "skin_tone": choice}}

    def chosen(self) -> Settings:
        """Return the settings that its stages are judged by. Raises Problem for a damaged choice of a skin tone."""
        return from_json(self.wanted(), preset(self.quality))


@dataclass(frozen=True)
class Batch:
    """A batch; `deliver` holds the settings of deliveries, or None, `blender` the renderer of contact sheets, or ''."""

    root: Path
    faces: tuple[BatchFace, ...]
    gate: str = GATES[0]
    deliver: dict | None = None
    blender: str = ""

    def face(self, name: str) -> BatchFace:
        """Return a face by its name. Raises Problem if there is none."""
        for face in self.faces:
            if face.name == name:
                return face
        raise Problem(
            f"The batch {self.root} has no face named {name!r}.",
            f"`python -m core batch status {self.root}` lists them.",
        )


def write_batch(batch: Batch) -> None:
    """Write batch.json. Raises Problem."""

    def portable(path: Path | str) -> str:
        return write_portable(path, batch.root)

    faces = [
        {
            "name": face.name,
            "source": portable(face.source),
            "capture": portable(face.root),
            "quality": face.quality,
            "settings": convert_settings(face.settings, portable),
        }
        for face in batch.faces
    ]
    deliver = batch.deliver and convert_settings({"deliver": batch.deliver}, portable)["deliver"]
    record = {"format": FORMAT, "gate": batch.gate, "blender": batch.blender, "deliver": deliver, "faces": faces}
    write_json(batch.root / NAME, record)


def read_batch(root: str | Path) -> Batch:
    """Read batch.json. Raises Problem if there is none, or if it is damaged or newer than this version."""
    root = Path(root).absolute()
    path = root / NAME
    try:
        record = read_json(path)
    except FileNotFoundError:
        raise Problem(
            f"There is no batch at {root}.", "Check the name; `python -m core batch plan SHOTS.csv BATCH` makes one."
        ) from None
    except (OSError, ValueError) as error:
        raise Problem(f"{path} cannot be read ({error}).", PLAN_AGAIN) from error
    if isinstance(record, dict) and isinstance(record.get("format"), int) and record["format"] > FORMAT:
        raise Problem("This batch was planned by a newer version of WildCap.", "Update WildCap to run it.")
    try:
        batch = _parse(root, record)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise Problem(f"{path} is not a batch record ({error!r}).", PLAN_AGAIN) from error
    names, roots = {face.name for face in batch.faces}, {face.root for face in batch.faces}
    if min(len(names), len(roots)) < len(batch.faces):
        raise Problem(f"{path} names a face or a capture twice.", PLAN_AGAIN)
    return batch


def _parse(root: Path, record: dict) -> Batch:
    if record["gate"] not in GATES or not isinstance(record["blender"], str):
        raise ValueError("invalid gate or Blender")
    deliver = record["deliver"]
    if deliver is not None:
        deliver = convert_settings({"deliver": deliver}, lambda path: str(read_portable(path, root)))["deliver"]
        from_json({"deliver": deliver})
    faces = tuple(_parse_face(root, face) for face in record["faces"])
    return Batch(root, faces, record["gate"], deliver, record["blender"])


def _parse_face(root: Path, record: dict) -> BatchFace:
    if not plain_name(record["name"]):
        raise ValueError("invalid name of a face")
    face = BatchFace(
        record["name"],
        read_portable(record["source"], root),
        read_portable(record["capture"], root),
        record["quality"],
        convert_settings(record["settings"], lambda path: str(read_portable(path, root))),
    )
    from_json(face.settings, preset(face.quality))
    return face
