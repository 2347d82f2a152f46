# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks the artist has put: landmarks_artist.json, {"points": {INDEX: [x, y, z]}} in metres of the capture's world.

An index is one of the 468 of MediaPipe's face mesh, as in landmarks.json. Written only by the add-on and `core
landmarks`; the stage registration reads it when it is there, and a point in it wins over what was found in the frames.
Ground floor: standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from .capture import Capture
from .files import remove_file, write_json
from .json_files import read_json
from .messages import Problem

COUNT = 468
FARTHEST_M = 0.5
"""A head's world has its origin between the eyes; what lies farther away was given in other units."""


def read(path: Path) -> dict[int, tuple[float, float, float]]:
    """The points by index; empty where there is no file. Raises Problem for a file that is not of this form."""
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
            f"{path} holds no landmarks.",
            'Write them as {"points": {"152": [0.0, -0.01, -0.11]}}: index, and position in metres.',
        )
    return _checked(points, str(path))


def put(capture: Capture, points: Mapping) -> dict[int, tuple[float, float, float]]:
    """Lays points {index: (x, y, z)} over those in the capture's file, an index with None taken out; the file goes with
    its last point.

    Returns all that are now in it. Raises Problem, and changes nothing, for an index or a position that cannot be.
    """
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    known = read(capture.landmarks_artist)
    known.update(_checked({k: p for k, p in points.items() if p is not None}, "What was given"))
    for index in [_index(k, "What was given") for k, p in points.items() if p is None]:
        known.pop(index, None)
    if known:
        write_json(capture.landmarks_artist, {"points": {str(k): list(p) for k, p in sorted(known.items())}})
    else:
        remove_file(capture.landmarks_artist)
    return known


def _checked(points: Mapping, owner: str) -> dict[int, tuple[float, float, float]]:
    landmarks = {}
    for key, point in points.items():
        index = _index(key, owner)
        try:
            x, y, z = (float(v) for v in point)
        except (TypeError, ValueError, OverflowError):
            x = y = z = math.nan
        if not all(abs(v) <= FARTHEST_M for v in (x, y, z)):  # false for nan, too
            raise Problem(
                f"{owner}: landmark {index} is at {point!r:.60}, which is not on the head.",
                "Give x, y and z in metres; the origin lies between the eyes.",
            )
        landmarks[index] = (x, y, z)
    return landmarks


def _index(key, owner: str) -> int:
    text = str(key)
    if not (text.isdecimal() and len(text) <= len(str(COUNT)) and int(text) < COUNT):
        raise Problem(
            f"{owner}: there is no landmark {key!r:.60}.",
            f"Landmarks are counted from 0 to {COUNT - 1}, as in landmarks.json.",
        )
    return int(text)
