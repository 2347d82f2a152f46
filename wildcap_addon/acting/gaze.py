# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An empty before the face that both eyes look at: drivers on the eight look units. They are simple expressions, which
Blender evaluates without any script."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.capture.messages import Problem
from .. import local_view
from . import mesh
from .asset import LEFT_EYE, SIDES, load
from .close_up.ball import places

KEY = "wildcap_gaze"
"""Custom property of the empty, and of the shape keys whose units look at it."""
AHEAD_M = 0.5
MOST_LOOK = 1.2
"""How far the units go: at 1 MakeHuman's turn eyes by 8 to 17 degrees, and at this by a fifth more; further on the lids
are drawn out of shape."""
WAYS = ("Out", "In", "Up", "Down")


@dataclass(frozen=True)
class _Eye:
    """centre [3] and what it looks at by the rest and by each unit at 1, unit vectors [3], in the head's axes."""

    centre: np.ndarray
    ahead: np.ndarray
    turned: dict[str, np.ndarray]


def of(obj) -> bpy.types.Object | None:
    return next((child for child in obj.children if KEY in child), None)


def add(context, obj) -> bpy.types.Object:
    """The empty half a metre before the eyes, where they look at rest, and the drivers. Raises Problem where the artist
    drives a look unit."""
    _refuse_own(obj.data.shape_keys)
    eyes = [_eye(obj, number) for number in range(2)]
    empty = bpy.data.objects.new(f"{obj.name} Gaze", None)
    empty.empty_display_type, empty.empty_display_size = 'SPHERE', 0.015
    empty[KEY] = True
    for collection in obj.users_collection:
        collection.objects.link(empty)
    empty.parent = obj
    empty.location = sum(eye.centre + AHEAD_M * eye.ahead for eye in eyes) / 2
    drive(obj, empty)
    local_view.join(context, [empty])
    return empty


def remove(obj) -> None:
    """The units that are still there are sliders again, at zero."""
    for key in filter(None, map(obj.data.shape_keys.key_blocks.get, _units())):
        key.driver_remove("value")
        key.value, key.slider_max = 0.0, 1.0
    del obj.data.shape_keys[KEY]
    bpy.data.objects.remove(of(obj))


def keep_up(obj, _capture) -> None:
    """The eyes of a head that was reconstructed anew lie elsewhere; those of one that was cut since, or lost a unit,
    stay as they are. `head.complete` asks."""
    if of(obj) is not None and mesh.is_complete(obj):
        drive(obj, of(obj))


def drive(obj, empty) -> None:
    """Each unit is as much of its turn as the eye needs to look at the empty, from 0 to MOST_LOOK."""
    obj.data.shape_keys[KEY] = True
    for number, side in enumerate(SIDES):
        eye = _eye(obj, number)
        outwards = 1 if number == 0 else -1
        x, y, z = (f"({name} - {value:.6f})" for name, value in zip("xyz", eye.centre, strict=True))
        yaw, pitch = f"atan2({outwards} * {x}, -{y})", f"atan2({z}, sqrt({x} * {x} + {y} * {y}))"
        for way in WAYS:
            gaze_angle, angle = (yaw, _yaw) if way in ("Out", "In") else (pitch, _pitch)
            rest, full = angle(eye.ahead, outwards), angle(eye.turned[way], outwards)
            key = obj.data.shape_keys.key_blocks[f"eyeLook{way}{side}"]
            key.driver_remove("value")
            key.slider_max = MOST_LOOK
            driver = key.driver_add("value").driver
            driver.type = 'SCRIPTED'
            driver.expression = f"max(0, min({MOST_LOOK}, ({gaze_angle} - {rest:.6f}) / {full - rest:.6f}))"
            for axis in "XYZ":
                variable = driver.variables.new()
                variable.name, variable.type = axis.lower(), 'TRANSFORMS'
                variable.targets[0].id, variable.targets[0].transform_type = empty, f'LOC_{axis}'
                variable.targets[0].transform_space = 'LOCAL_SPACE'


def _refuse_own(keys: bpy.types.Key) -> None:
    """Drivers of the units are ours where the keys are marked, also when somebody deleted the empty."""
    drivers = [] if KEY in keys or keys.animation_data is None else keys.animation_data.drivers
    taken = [name for name in _units() if any(f'"{name}"' in curve.data_path for curve in drivers)]
    if taken:
        raise Problem(f"{taken[0]} already has a driver of its own.", "Remove that driver, or go on without Gaze.")


def _units() -> list[str]:
    return [f"eyeLook{way}{side}" for side in SIDES for way in WAYS]


def _eye(obj, number: int) -> _Eye:
    """Of the left (0) or the right eye; its middle is that of the sphere that fits the ball best."""
    asset, keys = load(), obj.data.shape_keys.key_blocks
    inner = np.flatnonzero(asset.kind == LEFT_EYE + number)
    rows = len(asset.template) + len(asset.copies) + inner
    ball = places(keys[0])[rows]
    fit = np.concatenate([2 * ball, np.ones((len(ball), 1))], 1)
    centre = np.linalg.lstsq(fit, (ball**2).sum(1), rcond=None)[0][:3]
    pupil = rows[np.linalg.norm(asset.uvs[inner] - 0.5, axis=1).argmin()]
    looks = {way: _unit(places(keys[f"eyeLook{way}{SIDES[number]}"])[pupil] - centre) for way in WAYS}
    return _Eye(centre, _unit(places(keys[0])[pupil] - centre), looks)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _yaw(way: np.ndarray, outwards: int) -> float:
    """Radians towards the temple."""
    return float(np.arctan2(outwards * way[0], -way[1]))


def _pitch(way: np.ndarray, _outwards: int) -> float:
    """Radians upwards."""
    return float(np.arctan2(way[2], np.hypot(way[0], way[1])))
