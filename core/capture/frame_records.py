# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames.json: what the stage frames knows of each frame, as every reader gets it and as it is written.

Ground floor: standard library only. Keys in the file's order are the attributes in theirs; keys of other versions are
passed over, and those that an older version did not write have their defaults. Pixels are those of the written frame.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path

from .capture import Capture
from .files import write_json
from .json_files import is_number, plain_name, read_json
from .messages import Problem
from .stages import advise_again

VIDEO, PHOTOGRAPHS = "video", "photographs"
FULL = "full"
"""Folder in frames/ with the photographs under their frames' names as large as cameras are found by, in their own
exposure; absent where none is larger."""


@dataclass(frozen=True, kw_only=True)
class FrameRecord:
    """One frame. name: its file in frames/; video_frame: its number in the video, or among the photographs in order;
    time_s: None for a photograph; source: a photograph's own name; size: width and height; sharpness: higher is
    sharper; selected: whether the texture is made from it; face_box: left, top, right and bottom, None without a face,
    and its score in [0, 1]; yaw_deg: the turn of the head; focal_px: None where the file does not say it; blur in [0,
    1], brightness and noise in sRGB, the clipped share; eyes_open: height over width of the right and the left; blink;
    other_face: the prominence of a second face beside it; gain: what its linear R, G, B were multiplied by to even out
    the exposure."""

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
    """Raises Problem where frames.json is missing, damaged, or names as a frame what is no file of its own folder."""
    try:
        told = read_json(capture.frames_json)
        return Frames(tuple(_record(entry) for entry in told["frames"]), told.get("kind"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Problem(
            f"The frames of this capture cannot be read ({capture.frames_json.name}: {error}).", advise_again("frames")
        ) from error


def write_frames(folder: Path, frames: Frames) -> None:
    """frames.json in the folder of the frames."""
    kind = {} if frames.kind is None else {"kind": frames.kind}
    write_json(folder / "frames.json", {**kind, "frames": [asdict(record) for record in frames.records]})


def _record(entry: dict) -> FrameRecord:
    record = FrameRecord(
        **{key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key in KEYS}
    )
    if not plain_name(record.name):
        raise ValueError(f"{record.name!r} is no name of a frame")
    for name, sound in _JUDGES.items():
        if not sound(getattr(record, name)):
            raise ValueError(f"{record.name} has the {name} {getattr(record, name)!r:.60}")
    return record


def _numbers(count: int, low: float = -math.inf, optional: bool = True):
    """A judge of tuples of `count` numbers from `low` on; of None, too, where they are optional."""
    return lambda value: (
        value is None
        and optional
        or isinstance(value, tuple)
        and len(value) == count
        and all(is_number(each, low) for each in value)
    )


def _number(low: float = -math.inf, optional: bool = False):
    return lambda value: value is None and optional or is_number(value, low)


def _is_measure(value) -> bool:
    """Whether it was measured, though it may be no number (NaN): of a face that lies outside of the picture there is
    nothing to measure."""
    return isinstance(value, int | float) and not isinstance(value, bool)


_JUDGES = {
    "video_frame": _number(0, True),
    "time_s": _number(optional=True),
    "source": lambda value: isinstance(value, str),
    "size": _numbers(2, 1),
    "sharpness": _number(),
    "selected": lambda value: isinstance(value, bool),
    "face_box": _numbers(4),
    "face_score": _number(),
    "yaw_deg": _number(optional=True),
    "focal_px": _number(0, True),
    "blur": _is_measure,
    "brightness": _is_measure,
    "clipped": _is_measure,
    "noise": _is_measure,
    "eyes_open": _numbers(2),
    "blink": lambda value: isinstance(value, bool),
    "other_face": _number(),
    "gain": _numbers(3, optional=False),
}
"""Attribute -> whether a value from the file can be that."""
