# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Have both eyes look at an empty in front of the face, by drivers on the eight look units.

Simple expressions, which Blender evaluates without Python.
"""

from __future__ import annotations

import bpy

from ...core.capture.messages import Problem
from .. import local_view
from ..data_blocks import add_driver, new_child
from . import mesh
from .asset import SIDES
from .close_up import ball

KEY = "wildcap_gaze"
"""Custom property of the empty, and of the shape keys that it drives."""
AHEAD_M = 0.5
MOST_LOOK = 1.2
"""Upper limit of the driven units: MakeHuman's turn the eyes by 8 to 17 degrees at 1. Beyond 1.2 the lids deform."""
UNITS = [f"eyeLook{way}{side}" for side in SIDES for way in ball.WAYS]


def of(obj) -> bpy.types.Object | None:
    return next((child for child in obj.children if KEY in child), None)


def add(context, obj) -> None:
    """Add the empty half a metre in front of the eyes, and the drivers.

    Raises Problem if a look unit has a driver of the artist's.
    """
    _refuse_own(obj.data.shape_keys)
    empty = new_child(obj, f"{obj.name} Gaze")
    empty.empty_display_type, empty.empty_display_size = 'SPHERE', 0.015
    empty[KEY] = True
    eyes = [whole_ball(obj, number) for number in range(2)]
    empty.location = sum(eye.centre + AHEAD_M * eye.ahead() for eye in eyes) / 2
    drive(obj, empty)
    local_view.join(context, [empty])


def remove(obj) -> None:
    """Remove it, and set the remaining units back to zero."""
    for key in filter(None, map(obj.data.shape_keys.key_blocks.get, UNITS)):
        key.driver_remove("value")
        key.value, key.slider_max = 0.0, 1.0
    del obj.data.shape_keys[KEY]
    bpy.data.objects.remove(of(obj))


def keep_up(obj, _capture) -> None:
    """Renew the drivers for the new place of the eyes, unless the head was cut or lost a unit (head.COMPLETERS)."""
    if of(obj) is not None and mesh.is_complete(obj):
        drive(obj, of(obj))


def drive(obj, empty) -> None:
    """Drive each unit by the share of its turn that the eye needs to look at the empty."""
    obj.data.shape_keys[KEY] = True
    for number, side in enumerate(SIDES):
        eye = whole_ball(obj, number)
        outwards = 1 if number == 0 else -1
        x, y, z = (f"({name} - {value:.6f})" for name, value in zip("xyz", eye.centre, strict=True))
        yaw, pitch = f"atan2({outwards} * {x}, -{y})", f"atan2({z}, sqrt({x} * {x} + {y} * {y}))"
        for way, (up, left) in eye.turns.items():
            horizontal = way in ("Out", "In")
            angle, rest, turn = (yaw, outwards * eye.yaw, outwards * left) if horizontal else (pitch, eye.pitch, up)
            key = obj.data.shape_keys.key_blocks[f"eyeLook{way}{side}"]
            key.driver_remove("value")
            key.slider_max = MOST_LOOK
            driver = add_driver(key, "value", f"max(0, min({MOST_LOOK}, ({angle} - {rest:.6f}) / {turn:.6f}))")
            for axis in "XYZ":
                variable = driver.variables.new()
                variable.name, variable.type = axis.lower(), 'TRANSFORMS'
                variable.targets[0].id, variable.targets[0].transform_type = empty, f'LOC_{axis}'
                variable.targets[0].transform_space = 'LOCAL_SPACE'


def whole_ball(obj, number: int) -> ball.RiggedEyeball:
    """Return the left (0) or right eyeball, about the centre of the sphere that fits it with its cornea."""
    return ball.of(obj, number, beyond_rad=-1.0)


def _refuse_own(keys: bpy.types.Key) -> None:
    if KEY in keys or keys.animation_data is None:  # marked keys have our drivers, even if the empty was deleted
        return
    paths = [curve.data_path for curve in keys.animation_data.drivers]
    driven = next((name for name in UNITS if any(f'"{name}"' in path for path in paths)), None)
    if driven is not None:
        raise Problem(f"{driven} already has a driver of its own.", "Remove that driver, or do without Gaze.")
