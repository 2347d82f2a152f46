# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames.json: what the stage frames knows of each frame, as every reader gets it and as it is written.

Ground floor: standard library only. Keys in the file's order are the attributes in theirs; keys of other versions are passed over, and those that an
older version did not write have their defaults. Pixels are those of the written frame.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path

from .capture import Capture, write_json
from .messages import Problem

VIDEO, PHOTOGRAPHS = "video", "photographs"


@dataclass(frozen=True, kw_only=True)
class FrameRecord:
    """One frame. name: its file in frames/; video_frame: its number in the video, or among the photographs in order; time_s: None for a photograph;
    source: a photograph's own name; size: width and height; sharpness: higher is sharper; selected: whether the texture is made from it; face_box: left,
    top, right and bottom, None without a face, and its score in [0, 1]; yaw_deg: the turn of the head; focal_px: None where the file does not say it;
    blur in [0, 1], brightness and noise in sRGB, the clipped share; eyes_open: height over width of the right and the left; blink; other_face: the
    prominence of a second face beside it; gain: what its linear R, G, B were multiplied by to even out the exposure."""

    name: str
    video_frame: int | None = None
    time_s: float | None = None
    source: str = ""
    size: tuple[int, int] | None = None
    sharpness: float
    selected: bool
    face_box: tuple[float, float, float, float] | None = None
    face_score: float = 0.0
    yaw_deg: float | None = None
    focal_px: float | None = None
    blur: float = 0.0
    brightness: float = 0.0
    clipped: float = 0.0
    noise: float = 0.0
    eyes_open: tuple[float, float] | None = None
    blink: bool = False
    other_face: float = 0.0
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def shown(self) -> str:
        """The name that the artist knows it by."""
        return self.source or self.name


KEYS = {field.name for field in fields(FrameRecord)}


@dataclass(frozen=True)
class Frames:
    """A capture's frames in order. kind: VIDEO, PHOTOGRAPHS, or None where the file does not say it."""

    records: tuple[FrameRecord, ...]
    kind: str | None = None

    @cached_property
    def by_name(self) -> dict[str, FrameRecord]:
        return {record.name: record for record in self.records}


def read_frames(capture: Capture) -> Frames:
    """Raises Problem where frames.json is missing or damaged."""
    try:
        told = json.loads(capture.frames_json.read_text(encoding="utf-8"))
        return Frames(tuple(_record(entry) for entry in told["frames"]), told.get("kind"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Problem(f"The frames of this capture cannot be read ({error}).", "Run the stage frames again.") from error


def write_frames(folder: Path, frames: Frames) -> None:
    """frames.json in the folder of the frames."""
    kind = {} if frames.kind is None else {"kind": frames.kind}
    write_json(folder / "frames.json", {**kind, "frames": [asdict(record) for record in frames.records]})


def _record(entry: dict) -> FrameRecord:
    record = FrameRecord(**{key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key in KEYS})
    if not isinstance(record.name, str) or not isinstance(record.sharpness, int | float):
        raise ValueError(f"{record.name!r} is no frame")
    return record
