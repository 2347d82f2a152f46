# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames.json: the record of each frame, in pixels of the written frame.

Its keys are the attributes of FrameRecord, in their order. Unknown keys are ignored, missing ones have their defaults.
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
"""Folder in frames/ with larger photographs under their frames' names, in their own exposure, for the cameras."""


@dataclass(frozen=True, kw_only=True)
class FrameRecord:
    """One frame; None means not known.

    name: its file in frames/. video_frame: number in the video, or order among the photographs. source: a photograph's
    own name, below the source's folder. size: width, height. selected: used for the texture. face_box: left, top,
    right, bottom. face_score, blur: in [0, 1]. yaw_deg: turn of the head. brightness, noise: in sRGB. clipped: share of
    pixels. eyes_open: height over width of the right and left eye. other_face: prominence of a second face. zoom:
    magnification of a film's lens relative to its first frame; frames of one zoom share a camera. gain: factors of
    linear R, G, B that even out the exposure. focal_source, focal_deviation: tags that state focal_px, and the
    deviation of its log; focal_doubt: why a tag is not believed.
    """

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
    zoom: float = 1.0
    blur: float = 0.0
    brightness: float = 0.0
    clipped: float = 0.0
    noise: float = 0.0
    eyes_open: tuple[float, float] | None = None
    blink: bool = False
    other_face: float = 0.0
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    focal_source: str = ""
    focal_deviation: float = 0.0
    focal_doubt: str = ""

    @property
    def shown(self) -> str:
        """Name by which the artist knows it."""
        return self.source or self.name


ONLY_IF_TOLD = {"focal_source", "focal_deviation", "focal_doubt", "zoom"}
"""Keys that only photographs with metadata and zoomed films have."""
DEFAULTS = {field.name: field.default for field in fields(FrameRecord)}
KEYS = {*DEFAULTS}


@dataclass(frozen=True)
class Frames:
    """Frames of a capture in order. kind: VIDEO, PHOTOGRAPHS, or None if the file does not say it."""

    records: tuple[FrameRecord, ...]
    kind: str | None = None

    @cached_property
    def by_name(self) -> dict[str, FrameRecord]:
        """File name -> frame."""
        return {record.name: record for record in self.records}


def read_frames(capture: Capture) -> Frames:
    """Read frames.json. Raises Problem if it is missing or damaged, or names a file outside of its folder."""
    try:
        content = read_json(capture.frames_json)
        return Frames(tuple(_parse(entry) for entry in content["frames"]), content.get("kind"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Problem(
            f"The frames of this capture cannot be read ({capture.frames_json.name}: {error}).", advise_again("frames")
        ) from error


def write_frames(folder: Path, frames: Frames) -> None:
    """Write frames.json into the folder of the frames."""
    kind = {} if frames.kind is None else {"kind": frames.kind}
    entries = [
        {key: value for key, value in asdict(record).items() if key not in ONLY_IF_TOLD or value != DEFAULTS[key]}
        for record in frames.records
    ]
    write_json(folder / "frames.json", {**kind, "frames": entries})


def _parse(entry: dict) -> FrameRecord:
    record = FrameRecord(
        **{key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key in KEYS}
    )
    if not plain_name(record.name):
        raise ValueError(f"{record.name!r} is no name of a frame")
    for name, is_sound in _CHECKS.items():
        if not is_sound(getattr(record, name)):
            raise ValueError(f"{record.name} has the {name} {getattr(record, name)!r:.60}")
    return record


def _optional(is_sound):
    return lambda value: value is None or is_sound(value)


def _at_least(low: float):
    return lambda value: is_number(value, low)


def _tuple_of(count: int, low: float = -math.inf):
    return lambda value: (
        isinstance(value, tuple) and len(value) == count and all(is_number(each, low) for each in value)
    )


def _is_bool(value) -> bool:
    return isinstance(value, bool)


def _is_measure(value) -> bool:
    """Return whether a value is a number or NaN: a face outside of the picture cannot be measured."""
    return isinstance(value, int | float) and not isinstance(value, bool)


_CHECKS = {
    "video_frame": _optional(_at_least(0)),
    "time_s": _optional(is_number),
    "source": lambda value: isinstance(value, str),
    "size": _optional(_tuple_of(2, 1)),
    "sharpness": is_number,
    "selected": _is_bool,
    "face_box": _optional(_tuple_of(4)),
    "face_score": is_number,
    "yaw_deg": _optional(is_number),
    "focal_px": _optional(_at_least(0)),
    "zoom": lambda value: is_number(value, 0) and value > 0,
    "blur": _is_measure,
    "brightness": _is_measure,
    "clipped": _is_measure,
    "noise": _is_measure,
    "eyes_open": _optional(_tuple_of(2)),
    "blink": _is_bool,
    "other_face": is_number,
    "gain": _tuple_of(3),
    "focal_source": lambda value: isinstance(value, str),
    "focal_deviation": _at_least(0),
    "focal_doubt": lambda value: isinstance(value, str),
}
"""Attribute -> check of a value from the file."""
