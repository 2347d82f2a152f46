# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""eyes.json: the eyeballs of a face that was filmed with open eyes, and maps/irises.json: their colours. Absent where
the eyes were closed.

Ground floor: standard library only.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
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
    """centre in the world and radius, in metres; gaze: where it looks, a unit vector; openness of its lids, 1 as far as
    MakeHuman opens them; iris_radius in metres, 0 where no frame showed it; views: how many frames told of it (0:
    placed by the other eye, or by the head)."""

    centre: tuple[float, float, float]
    radius: float
    gaze: tuple[float, float, float]
    openness: float
    iris_radius: float
    views: int


def write_eyes(capture: Capture, left: Eyeball, right: Eyeball) -> None:
    write_json(capture.eyes, {side: asdict(eye) for side, eye in zip(SIDES, (left, right), strict=True)})


def read_eyes(capture: Capture) -> tuple[Eyeball, Eyeball]:
    """The left and the right eyeball. Raises Problem for a damaged file."""
    try:
        told = read_json(capture.eyes)
        return tuple(_eyeball(told[side]) for side in SIDES)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(f"{capture.eyes} cannot be read ({error}).", advise_again("registration")) from error


def write_irises(path: Path, left: Colour, right: Colour) -> None:
    """The irises' linear albedo, beside the maps that it belongs to."""
    write_json(path, dict(zip(SIDES, (left, right), strict=True)))


def read_irises(capture: Capture) -> tuple[Colour, Colour] | None:
    """Linear albedo of the left and the right iris; None where it was not measured. Raises Problem for a damaged
    file."""
    if not capture.irises.is_file():
        return None
    try:
        told = read_json(capture.irises)
        left, right = (_vector(told[side]) for side in SIDES)
        if not all(0 <= value <= 1 for value in (*left, *right)):
            raise ValueError("an iris has no such colour")
        return left, right
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(f"{capture.irises} cannot be read ({error}).", advise_again("solve")) from error


def _eyeball(record: dict) -> Eyeball:
    eye = Eyeball(
        _vector(record["centre"]),
        record["radius"],
        _vector(record["gaze"]),
        record["openness"],
        record["iris_radius"],
        record["views"],
    )
    counted = all(is_number(value, 0) for value in (eye.openness, eye.iris_radius, eye.views))
    if not counted or not is_number(eye.radius, 1e-4):
        raise ValueError("an eye has no size")
    if abs(math.hypot(*eye.gaze) - 1) > 1e-3:
        raise ValueError("an eye looks nowhere")
    return eye


def _vector(coordinates: list) -> tuple[float, float, float]:
    x, y, z = coordinates
    if not all(is_number(value) for value in (x, y, z)):
        raise ValueError("an eye lies nowhere")
    return x, y, z
