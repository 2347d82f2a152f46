# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights for a first look at a head: three of lamps, or the surroundings of a picture. Built in a scene of their own, around a head of any place,
turn and size.

Directions are the head's: +X its left, -Y where it looks, +Z up. Distances are in head radii, powers are for a head of the reference radius.
"""

from dataclasses import dataclass
from math import radians

import bpy
from mathutils import Matrix, Vector

from ..hdri import Hdri, light_with

REFERENCE_RADIUS_M = 0.15


@dataclass(frozen=True)
class Lamp:
    """An area lamp (power in watts at the reference radius) or, without a size, a sun (power in W/m2)."""

    name: str
    direction: tuple[float, float, float]
    power: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    size: float = 0.0  # side in head radii
    distance: float = 6.0  # in head radii
    angle: float = 0.5  # of a sun, in degrees


@dataclass(frozen=True)
class Preset:
    lamps: tuple[Lamp, ...]
    world: tuple[float, float, float]


PRESETS = {
    "studio": Preset((
        Lamp("Key", (-0.9, -1.0, 0.7), 16.0, (1.0, 0.96, 0.92), size=3.0),
        Lamp("Fill", (1.2, -0.8, 0.1), 4.0, (0.92, 0.96, 1.0), size=4.0),
        Lamp("Rim", (0.9, 1.2, 0.5), 6.0, size=2.0),
    ), (0.02, 0.02, 0.022)),
    "sun": Preset((Lamp("Sun", (0.75, -1.0, 0.7), 3.5, (1.0, 0.9, 0.76)),), (0.16, 0.21, 0.3)),
    "window": Preset((Lamp("Window", (-1.3, -0.45, 0.25), 22.0, (0.93, 0.97, 1.0), size=5.0, distance=5.0),), (0.012, 0.011, 0.01)),
}


def build(scene: bpy.types.Scene, light: str | Hdri, frame: Matrix, radius: float) -> None:
    """Replaces the lamps and the world of `scene` by those of a preset or of a picture. `frame` [4, 4] is the head's place without scale, `radius` its
    size in scene units."""
    for obj in [o for o in scene.objects if o.type == 'LIGHT']:
        bpy.data.lights.remove(obj.data)  # takes its object along
    preset = PRESETS[light] if isinstance(light, str) else Preset((), (0.0, 0.0, 0.0))
    for lamp in preset.lamps:
        scene.collection.objects.link(_lamp(lamp, frame, radius))
    scene.world = _world(preset.world)
    if isinstance(light, Hdri):
        light_with(scene.world, light, frame.to_euler().z)


def _lamp(lamp: Lamp, frame: Matrix, radius: float) -> bpy.types.Object:
    data = bpy.data.lights.new(f"WildCap {lamp.name}", 'AREA' if lamp.size else 'SUN')
    data.color = lamp.colour
    if lamp.size:
        data.size = lamp.size * radius
        data.energy = lamp.power * (radius / REFERENCE_RADIUS_M) ** 2
    else:
        data.energy = lamp.power
        data.angle = radians(lamp.angle)
    obj = bpy.data.objects.new(data.name, data)
    direction = Vector(lamp.direction).normalized()
    obj.matrix_world = frame @ Matrix.Translation(direction * lamp.distance * radius) @ direction.to_track_quat('Z', 'Y').to_matrix().to_4x4()
    return obj


def _world(colour: tuple[float, float, float]) -> bpy.types.World:
    world = bpy.data.worlds.get("WildCap Relight") or bpy.data.worlds.new("WildCap Relight")
    world.use_nodes = True
    for node in [n for n in world.node_tree.nodes if n.type not in ('BACKGROUND', 'OUTPUT_WORLD')]:
        world.node_tree.nodes.remove(node)
    background = next(n for n in world.node_tree.nodes if n.type == 'BACKGROUND')
    background.inputs["Color"].default_value = (*colour, 1.0)
    background.inputs["Strength"].default_value = 1.0
    return world
