# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks placed by the artist: landmarks_artist.json, {"points": {INDEX: [x, y, z]}}.

Positions are in metres of the capture's world. An index is one of the 468 of MediaPipe's face mesh.
Only the add-on and `core landmarks` write the file; in the stage registration its points win over those of the frames.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from .capture import Capture
from .files import remove_file, write_json
from .json_files import is_number, read_json
from .messages import Problem

COUNT = 468
FARTHEST_M = 0.5
"""The world's origin lies between the eyes; a point farther away was given in other units."""


def read(path: Path) -> dict[int, tuple[float, float, float]]:
    """Return the points by index, {} if there is no file. Raises Problem if it is not of this form."""
    try:
        record = read_json(path)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise Problem(
            f"The landmarks in {path} cannot be read ({error}).",
            "Correct the file, or delete it to use the landmarks found in the frames.",
        ) from error
    points = record.get("points") if isinstance(record, dict) else None
    if not isinstance(points, dict):
        raise Problem(
            f"{path} contains no landmarks.",
            'Write them as {"points": {"152": [0.0, -0.01, -0.11]}}: index, and position in metres.',
        )
    return _check(points, str(path))


def put(capture: Capture, points: Mapping) -> dict[int, tuple[float, float, float]]:
    """Add points {index: (x, y, z)} to the capture's file, or remove those that are None, and return all.

    The file is removed with its last point. Raises Problem, and changes nothing, for an impossible index or position.
    """
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    placed = {key: point for key, point in points.items() if point is not None}
    landmarks = {**read(capture.landmarks_artist), **_check(placed, "The new landmarks")}
    for key in points.keys() - placed.keys():
        landmarks.pop(_index(key, "The new landmarks"), None)
    if landmarks:
        write_json(capture.landmarks_artist, {"points": {str(k): list(p) for k, p in sorted(landmarks.items())}})
    else:
        remove_file(capture.landmarks_artist)
    return landmarks


def _check(points: Mapping, owner: str) -> dict[int, tuple[float, float, float]]:
    indices = {_index(key, owner): key for key in points}
    return {index: _position(points[key], f"{owner}: landmark {index}") for index, key in indices.items()}


def _index(key, owner: str) -> int:
    text = str(key)
    if not (text.isdecimal() and len(text) <= len(str(COUNT)) and int(text) < COUNT):
        raise Problem(
            f"{owner}: there is no landmark {key!r:.60}.",
            f"Landmarks are counted from 0 to {COUNT - 1}, as in landmarks.json.",
        )
    return int(text)


def _position(point, owner: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(v) for v in point)
    except (TypeError, ValueError, OverflowError):
        x = y = z = math.nan
    if not all(is_number(v, -FARTHEST_M, FARTHEST_M) for v in (x, y, z)):
        raise Problem(
            f"{owner} is at {point!r:.60}, which is not on the head.",
            "Give x, y and z in metres; the origin lies between the eyes.",
        )
    return x, y, z
