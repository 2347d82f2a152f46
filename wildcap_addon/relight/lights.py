# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights for a first look at a head of any place, turn and size: six presets of lamps under a sky, or surroundings.

Directions are the head's: +X its left, -Y where it looks, +Z up. Distances are in head radii, powers are for a head of
the reference radius. They are set by a grey ball in the head's place, as by an incident light meter: where the light is
strongest, its 18 % are rendered as 18 %, so that skin shows as light as it is. The rims are dimmer, for at a grazing
angle all skin mirrors them.
"""

from dataclasses import dataclass
from math import radians

import bpy
from mathutils import Matrix, Vector

from ..colours import to_working
from ..data_blocks import stop_animation
from ..hdri import Hdri, light_with
from . import sky

REFERENCE_RADIUS_M = 0.15
SUN_ANGLE_RAD = radians(0.5)
RIG = "WildCap Lights"
"""Name of the empty at the head's centre that carries the lamps: turning it turns the light."""


@dataclass(frozen=True)
class Lamp:
    """Area lamp (power in watts at the reference radius) or, without a size, a sun (power in W/m2)."""

    name: str
    direction: tuple[float, float, float]
    power: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    size: float = 0.0  # side in head radii
    distance: float = 6.0  # in head radii


@dataclass(frozen=True)
class LightingPreset:
    lamps: tuple[Lamp, ...]
    sky: sky.Sky


PRESETS = {
    "three_point": LightingPreset(
        (
            Lamp("Key", (-0.9, -1.0, 0.7), 6.46, (1.0, 0.96, 0.92), size=3.0),
            Lamp("Fill", (1.2, -0.8, 0.1), 1.61, (0.92, 0.96, 1.0), size=4.0),
            Lamp("Rim", (0.9, 1.2, 0.5), 2.42, size=2.0),
        ),
        sky.even((0.00807, 0.00807, 0.00888)),
    ),
    "window": LightingPreset(
        (Lamp("Window", (-1.3, -0.45, 0.25), 5.64, (0.93, 0.97, 1.0), size=5.0, distance=5.0),),
        sky.even((0.00308, 0.00282, 0.00256)),
    ),
    "sun": LightingPreset(
        (Lamp("Sun", (0.75, -1.0, 0.7), 3.01, (1.0, 0.9, 0.76)),),
        sky.Sky((0.1, 0.151, 0.244), (0.143, 0.172, 0.208), (0.0932, 0.0789, 0.061)),
    ),
    "overcast": LightingPreset((), sky.Sky((1.37, 1.41, 1.47), (0.457, 0.47, 0.489), (0.17, 0.157, 0.143))),
    "rim": LightingPreset(
        (
            Lamp("Left Rim", (1.0, 0.85, 0.3), 4.8, (1.0, 0.97, 0.94), size=3.0, distance=5.0),
            Lamp("Right Rim", (-1.0, 0.95, 0.35), 3.7, (0.9, 0.95, 1.0), size=3.0, distance=5.0),
            Lamp("Front", (0.1, -1.0, 0.35), 2.3, size=4.0),
        ),
        sky.even((0.00532, 0.00532, 0.00621)),
    ),
    "coloured": LightingPreset(
        (
            Lamp("Teal", (-1.2, -0.7, 0.25), 10.4, (0.05, 0.62, 0.9), size=2.5),
            Lamp("Magenta", (1.15, -0.55, 0.2), 10.4, (1.0, 0.1, 0.42), size=2.5),
            Lamp("Above", (0.0, -0.5, 1.3), 2.6, size=2.0),
        ),
        sky.even((0.00692, 0.00606, 0.0104)),
    ),
}
"""Presets by the identifiers of properties.LIGHTS, which has their names and tooltips."""
NAMED_BEFORE = {"studio": "three_point"}


def preset(name: str) -> LightingPreset:
    """Return a preset by its present or former identifier."""
    return PRESETS[NAMED_BEFORE.get(name, name)]


def build_light(scene: bpy.types.Scene, light: str | Hdri, frame: Matrix, radius: float, turn: float) -> None:
    """Replace the lamps and the world of a scene by a preset, or by a picture of surroundings.

    frame, radius: the head's place without scale and its size in scene units (picture.frame_of); turn: of the light
    about the head, in radians, counter-clockwise from above.
    """
    clear(scene)
    frame = frame @ Matrix.Rotation(turn, 4, 'Z')
    scene.world = sky.world()
    if isinstance(light, Hdri):
        light_with(scene.world, light, frame.to_euler().z)
    else:
        add_lamps(scene, preset(light).lamps, frame, radius)
        sky.show(scene.world, preset(light).sky, frame)


def clear(scene: bpy.types.Scene) -> None:
    """Remove the lamps and their rig."""
    for obj in [o for o in scene.objects if o.type in ('LIGHT', 'EMPTY') and o.name.startswith("WildCap ")]:
        stop_animation(obj)
        if obj.data is not None:
            bpy.data.lights.remove(obj.data)  # and its object
        else:
            bpy.data.objects.remove(obj)


def rig(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return what carries the scene's lamps."""
    return next((o for o in scene.objects if o.type == 'EMPTY' and o.name.startswith(RIG)), None)


def add_lamps(scene: bpy.types.Scene, lamps: tuple[Lamp, ...], frame: Matrix, radius: float) -> list[bpy.types.Object]:
    """Put lamps around the head, on the scene's rig, which is made at `frame` if need be; return their objects."""
    carrier = rig(scene)
    if carrier is None:
        carrier = bpy.data.objects.new(RIG, None)
        carrier.matrix_world = frame
        scene.collection.objects.link(carrier)
    objects = [_lamp(lamp, radius) for lamp in lamps]
    for obj in objects:
        scene.collection.objects.link(obj)
        obj.parent = carrier
    return objects


def _lamp(lamp: Lamp, radius: float) -> bpy.types.Object:
    data = bpy.data.lights.new(f"WildCap {lamp.name}", 'AREA' if lamp.size else 'SUN')
    data.color = to_working(lamp.colour)
    if lamp.size:
        data.size = lamp.size * radius
        data.energy = lamp.power * (radius / REFERENCE_RADIUS_M) ** 2
    else:
        data.energy = lamp.power
        data.angle = SUN_ANGLE_RAD
    obj = bpy.data.objects.new(data.name, data)
    direction = Vector(lamp.direction).normalized()
    place = Matrix.Translation(direction * lamp.distance * radius)
    obj.matrix_local = place @ direction.to_track_quat('Z', 'Y').to_matrix().to_4x4()
    return obj
