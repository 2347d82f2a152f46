# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a capture in a strip, each with how sharp it is. Read by a timer when a panel has asked; icons of their own, so that no
data-block is made behind the artist's back.
"""

from dataclasses import dataclass

import bpy
import bpy.utils.previews

from ...core.contract.capture import Capture
from ...core.contract.frame_records import read_frames
from ...core.contract.messages import Problem
from .. import captures, status

INTERVAL_S = 0.5
MOST = 12
"""Frames in the strip"""
BLURRED = 0.5
"""Sharpness below this share of the median counts as blurred."""


@dataclass(frozen=True)
class Frame:
    """sharpness: in shares of the sharpest frame's; icon 0: the file is missing."""

    name: str
    sharpness: float
    blurred: bool
    icon: int


@dataclass(frozen=True)
class Strip:
    """Some frames of a capture, those that the texture uses first choice; how many there are, are used, and are blurred in all."""

    frames: tuple[Frame, ...]
    count: int
    used: int
    blurred: int


_known: dict[str, tuple[int, Strip | None]] = {}  # capture folder -> (time of frames.json, strip)
_wanted: set[str] = set()
_icons: bpy.utils.previews.ImagePreviewCollection | None = None


def of(item) -> Strip | None:
    """The last known strip of a list item; None before the first look, or where there are no frames."""
    root = captures.root(item)
    _wanted.add(root)
    return _known[root][1] if root in _known else None


def look(root: str) -> bool:
    """Reads the capture's frames.json if it is another one than before. True if so."""
    capture = Capture(root)
    time = capture.frames_json.stat().st_mtime_ns if capture.frames_json.is_file() else 0
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
    values = [frame.sharpness for frame in frames]
    used = [i for i, frame in enumerate(frames) if frame.selected]
    limit = BLURRED * sorted(values)[len(values) // 2]
    choice = used or list(range(len(frames)))
    shown = [choice[i * len(choice) // min(MOST, len(choice))] for i in range(min(MOST, len(choice)))]
    sharpest = max(values) or 1.0
    return Strip(tuple(Frame(frames[i].name.rpartition(".")[0], values[i] / sharpest, values[i] < limit, _icon(capture.frames / frames[i].name))
                       for i in shown), len(frames), len(used), sum(value < limit for value in values))


def _icon(path) -> int:
    """The icon of a frame; its picture is read when Blender first draws it."""
    global _icons
    if not path.is_file():
        return 0
    if _icons is None:
        _icons = bpy.utils.previews.new()
    key = str(path)
    _icons.pop(key, None)
    return _icons.load(key, key, 'IMAGE', force_reload=True).icon_id


def _tick() -> float:
    for root in list(_wanted):
        if look(root):
            status.redraw()
    return INTERVAL_S


def register():
    bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)


def unregister():
    global _icons
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = None
    _known.clear()
    _wanted.clear()
