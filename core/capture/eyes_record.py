# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyeballs of a face filmed with open eyes, eyes.json, and their colours, maps/irises.json."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from .capture import Capture
from .files import write_json
from .json_files import is_number, read_json
from .messages import Problem
from .stages import advise_again

SIDES = ("left", "right")
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Eyeball:
    """Eyeball in the world, in metres.

    `gaze` is a unit vector. `openness` of the lids is 1 at MakeHuman's widest. `iris_radius` is 0 if no frame showed
    the iris. `views` counts the frames that showed the eye (0: placed by the other eye, or by the head).
    """

    centre: tuple[float, float, float]
    radius: float
    gaze: tuple[float, float, float]
    openness: float
    iris_radius: float
    views: int


def write_eyes(capture: Capture, left: Eyeball, right: Eyeball) -> None:
    """Write eyes.json."""
    write_json(capture.eyes, {side: asdict(eye) for side, eye in zip(SIDES, (left, right), strict=True)})


def read_eyes(capture: Capture) -> tuple[Eyeball, Eyeball]:
    """Return the left and the right eyeball. Raises Problem for a damaged file."""
    try:
        record = read_json(capture.eyes)
        return tuple(_parse_eyeball(record[side]) for side in SIDES)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(f"{capture.eyes} cannot be read ({error}).", advise_again("registration")) from error


def write_irises(path: Path, left: Colour, right: Colour) -> None:
    """Write the linear albedo of the irises."""
    write_json(path, dict(zip(SIDES, (left, right), strict=True)))


def read_irises(capture: Capture) -> tuple[Colour, Colour] | None:
    """Return the linear albedo of the left and right iris, or None. Raises Problem for a damaged file."""
    if not capture.irises.is_file():
        return None
    try:
        record = read_json(capture.irises)
        left, right = (_parse_vector(record[side]) for side in SIDES)
        if not all(0 <= value <= 1 for value in (*left, *right)):
            raise ValueError("an iris has no such colour")
        return left, right
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(f"{capture.irises} cannot be read ({error}).", advise_again("solve")) from error


def _parse_eyeball(record: dict) -> Eyeball:
    vectors = {name: _parse_vector(record[name]) for name in ("centre", "gaze")}
    eye = Eyeball(**{field.name: record[field.name] for field in fields(Eyeball)} | vectors)
    if not all(is_number(value, 0) for value in (eye.openness, eye.iris_radius, eye.views)):
        raise ValueError("an eye has no size")
    if not is_number(eye.radius, 1e-4):
        raise ValueError("an eye has no size")
    if abs(math.hypot(*eye.gaze) - 1) > 1e-3:
        raise ValueError("an eye has no gaze")
    return eye


def _parse_vector(coordinates: list) -> tuple[float, float, float]:
    x, y, z = coordinates
    if not all(is_number(value) for value in (x, y, z)):
        raise ValueError("an eye has no position")
    return x, y, z
