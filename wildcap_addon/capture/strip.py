# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strip of a capture's frames with their sharpness, read by a timer once a panel wants it."""

from dataclasses import dataclass

import bpy

from ...core.capture.capture import Capture
from ...core.capture.frame_records import read_frames
from ...core.capture.messages import Problem
from .. import captures, frame_icons, status
from ..batch_watch import modified_ns

INTERVAL_S = 0.5
MOST_FRAMES = 12
"""Number of frames in the strip."""
BLURRED_SHARE = 0.5
"""Sharpness below this share of the median counts as blurred."""


@dataclass(frozen=True)
class Frame:
    """Frame with its sharpness relative to the sharpest one; icon 0: the file is missing."""

    name: str
    sharpness: float
    blurred: bool
    icon: int


@dataclass(frozen=True)
class Strip:
    """Some frames of a capture, preferably those of the texture, and how many exist, are used and are blurred."""

    frames: tuple[Frame, ...]
    count: int
    used: int
    blurred: int


_known: dict[str, tuple[int, Strip | None]] = {}  # capture folder -> (time of frames.json, strip)
_wanted: set[str] = set()


def of(item) -> Strip | None:
    """Return the last known strip of a list item; None before the first look, or without frames."""
    root = captures.root(item)
    _wanted.add(root)
    return _known[root][1] if root in _known else None


def look(root: str) -> bool:
    """Read the capture's frames.json if it has changed, and return whether."""
    capture = Capture(root)
    time = modified_ns(capture.frames_json)
    if root in _known and _known[root][0] == time:
        return False
    _known[root] = time, _read(capture)
    return True


def _read(capture: Capture) -> Strip | None:
    try:
        frames = read_frames(capture).records
    except Problem:
        return None
    if not frames:
        return None
    sharpness = [frame.sharpness for frame in frames]
    selected_indices = [i for i, frame in enumerate(frames) if frame.selected]
    limit = BLURRED_SHARE * sorted(sharpness)[len(sharpness) // 2]
    choice = selected_indices or list(range(len(frames)))
    indices = [choice[i * len(choice) // min(MOST_FRAMES, len(choice))] for i in range(min(MOST_FRAMES, len(choice)))]
    sharpest = max(sharpness) or 1.0
    strip = tuple(
        Frame(
            frames[i].name.rpartition(".")[0],
            sharpness[i] / sharpest,
            sharpness[i] < limit,
            frame_icons.load(capture.frames / frames[i].name),
        )
        for i in indices
    )
    return Strip(strip, len(frames), len(selected_indices), sum(value < limit for value in sharpness))


def _tick() -> float:
    for root in list(_wanted):
        if look(root):
            status.redraw()
    _wanted.intersection_update(status.shown())
    return INTERVAL_S


def register():
    bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _known.clear()
    _wanted.clear()
