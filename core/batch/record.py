# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""batch.json: which faces a batch has and what is asked for each. It says nothing of what has been done. Standard
library only.

    {"format": 1, "gate": "automatic", "blender": "", "deliver": {}, "faces": [{"name", "source", "capture", "quality",
    "settings"}]}

Paths are relative to the batch's folder where they travel with it (portable_paths.py), so that machines may see it
under different names.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.json_files import plain_name, read_json
from ..capture.messages import Problem
from ..capture.portable_paths import convert_settings, read_portable, write_portable
from ..settings import settings as known
from ..settings.settings import Settings

FORMAT = 1
NAME = "batch.json"
GATES = ("automatic", "artist")
"""Whether a face is solved with its proposed mask, or waits until the artist has accepted or painted one."""


@dataclass(frozen=True)
class BatchFace:
    """`source` is a video or a folder of photographs; `settings` ({stage: {name: value}, seed, device}) lie over the
    preset `quality`; paths are absolute."""

    name: str
    source: Path
    root: Path
    quality: str = "standard"
    settings: dict = field(default_factory=dict)

    @property
    def capture(self) -> Capture:
        return Capture(self.root)

    def chosen(self) -> Settings:
        """What its stages are judged by."""
        return known.from_json(self.settings, known.preset(self.quality))


@dataclass(frozen=True)
class Batch:
    """`deliver` holds the settings of what is delivered of each face, None: nothing is; `blender` is the program that
    renders contact sheets, '': none."""

    root: Path
    faces: tuple[BatchFace, ...]
    gate: str = GATES[0]
    deliver: dict | None = None
    blender: str = ""

    def face(self, name: str) -> BatchFace:
        """Raises Problem for an unknown name."""
        for face in self.faces:
            if face.name == name:
                return face
        raise Problem(
            f"The batch {self.root} has no face named {name!r}.",
            f"`python -m core batch status {self.root}` lists them.",
        )


def write_batch(batch: Batch) -> None:
    """Raises Problem where it cannot be written."""

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
    write_json(
        batch.root / NAME,
        {"format": FORMAT, "gate": batch.gate, "blender": batch.blender, "deliver": deliver, "faces": faces},
    )


def read_batch(root: str | Path) -> Batch:
    """Raises Problem for a folder that is no batch, and for a record that is damaged or newer than this version."""
    root = Path(root).absolute()
    path = root / NAME
    try:
        told = read_json(path)
    except FileNotFoundError:
        raise Problem(
            f"There is no batch at {root}.", "Check the name; `python -m core batch plan SHOTS.csv BATCH` makes one."
        ) from None
    except (OSError, ValueError) as error:
        raise Problem(
            f"{path} cannot be read ({error}).", "Plan the batch again from its table: what its captures hold is kept."
        ) from error
    if isinstance(told, dict) and isinstance(told.get("format"), int) and told["format"] > FORMAT:
        raise Problem(
            "This batch was planned by a newer version of WildCap.", "Update WildCap to run it; nothing was changed."
        )
    try:
        batch = _parse(root, told)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise Problem(
            f"{path} is not a batch record ({error!r}).",
            "Plan the batch again from its table: what its captures hold is kept.",
        ) from error
    names, roots = {face.name for face in batch.faces}, {face.root for face in batch.faces}
    if len(names) < len(batch.faces) or len(roots) < len(batch.faces):
        raise Problem(
            f"{path} names a face or a capture twice.",
            "Plan the batch again from its table: what its captures hold is kept.",
        )
    return batch


def _parse(root: Path, record: dict) -> Batch:
    if record["gate"] not in GATES or not isinstance(record["blender"], str):
        raise ValueError("its gate makes no sense")
    deliver = record["deliver"]
    if deliver is not None:
        deliver = convert_settings({"deliver": deliver}, lambda path: str(read_portable(path, root)))["deliver"]
        known.from_json({"deliver": deliver})
    return Batch(
        root, tuple(_parse_face(root, face) for face in record["faces"]), record["gate"], deliver, record["blender"]
    )


def _parse_face(root: Path, record: dict) -> BatchFace:
    if not plain_name(record["name"]):
        raise ValueError("a face's name is none")
    face = BatchFace(
        record["name"],
        read_portable(record["source"], root),
        read_portable(record["capture"], root),
        record["quality"],
        convert_settings(record["settings"], lambda path: str(read_portable(path, root))),
    )
    face.chosen()
    return face
