# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a source, a video or photographs, under a choice of the setting Colour."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ...capture.messages import Reporter
from ...capture.photographs import is_photograph
from ...capture.picture_kinds import EXR, RAW, kind_of
from .log_curves import RECORDED, decode
from .photographs import read_photographs
from .source import Picture
from .video import read_video


def read_source(path: Path, most: int, long_side: int, colour: str, report: Reporter) -> Iterator[Picture]:
    """Yield at most `most` pictures, evenly spread, shrunk to `long_side` pixels. Raises Problem if there are none."""
    if not (path.is_dir() or is_photograph(path)):
        return read_video(path, most, long_side, report, colour)
    photographs = read_photographs(path, most, long_side, report)
    if colour == RECORDED:
        return photographs
    folder = path if path.is_dir() else path.parent
    return (_decoded(picture, folder / picture.source, colour) for picture in photographs)


def _decoded(picture: Picture, path: Path, colour: str) -> Picture:
    if kind_of(path) in (EXR, RAW):  # linear light, whatever is chosen for the others
        return picture
    full = None if picture.full is None else decode(picture.full, colour)
    return replace(picture, srgb=decode(picture.srgb, colour), full=full)
