# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""World of the relight scene: a gradient from horizon to zenith, over a ground.

Radiance is linear in the sine of the elevation: with a zenith three times as bright as the horizon that is the overcast
sky of Moon and Spencer (1942), the CIE's traditional one.
"""

from dataclasses import astuple, dataclass

import bpy
from mathutils import Matrix

from .. import node_trees
from ..colours import to_working
from ..data_blocks import find, stop_animation
from ..node_trees import add, feed

WORLD = "WildCap Relight"
HORIZON_BLEND = 0.04
"""Sine of the elevation above and below the horizon over which ground and sky meet."""
MIX_A, MIX_B, MIX_RESULT = 6, 7, 2
"""Indices of a Mix node's sockets for colours: its names occur for every data type."""
COLOURS = ("WildCap Sky", MIX_A), ("WildCap Sky", MIX_B), ("WildCap Ground", MIX_A)
"""Node and socket of a sky's horizon, zenith and ground."""


@dataclass(frozen=True)
class Sky:
    """Radiances, linear RGB of sRGB's primaries."""

    zenith: tuple[float, float, float]
    horizon: tuple[float, float, float]
    ground: tuple[float, float, float]


def even(colour: tuple[float, float, float]) -> Sky:
    """Return a uniform sky."""
    return Sky(colour, colour, colour)


def world() -> bpy.types.World:
    """Return the relight scene's world, black and without any other node than the background."""
    sky_world = find(bpy.data.worlds, WORLD) or bpy.data.worlds.new(WORLD)
    tree = node_trees.of(sky_world)
    stop_animation(tree)
    for node in [n for n in tree.nodes if n.type not in ('BACKGROUND', 'OUTPUT_WORLD')]:
        tree.nodes.remove(node)
    feed(_background(tree), {"Color": (0.0, 0.0, 0.0, 1.0), "Strength": 1.0})
    sky_world.cycles.sampling_method = 'AUTOMATIC'
    return sky_world


def show(world: bpy.types.World, sky: Sky, frame: Matrix) -> None:
    """Make the sky the world's background, upright with the head at `frame` [4, 4]."""
    tree = world.node_tree
    direction = add(tree, 'ShaderNodeTexCoord', location=(-1100, 0)).outputs["Generated"]
    turned = {"Vector": direction, "Rotation": frame.to_quaternion().inverted().to_euler()}
    upright = add(tree, 'ShaderNodeMapping', turned, location=(-920, 0)).outputs["Vector"]
    z = add(tree, 'ShaderNodeSeparateXYZ', (upright,), location=(-740, 0)).outputs["Z"]
    rise = add(tree, 'ShaderNodeClamp', {"Value": z}, location=(-560, 0))
    blend = {"Value": z, "From Min": -HORIZON_BLEND, "From Max": HORIZON_BLEND}
    edge = add(tree, 'ShaderNodeMapRange', blend, location=(-560, -160))
    above = _mix(tree, "WildCap Sky", {0: rise.outputs["Result"]}, -380)
    below = _mix(tree, "WildCap Ground", {0: edge.outputs["Result"], MIX_B: above.outputs[MIX_RESULT]}, -200)
    feed(_background(tree), {"Color": below.outputs[MIX_RESULT]})
    # it is smooth, and a fine importance map would take a second to compute
    world.cycles.sampling_method, world.cycles.sample_map_resolution = 'MANUAL', 128
    for socket, colour in zip(sockets(world), colours(sky), strict=True):
        socket.default_value = colour


def sockets(world: bpy.types.World) -> list[bpy.types.NodeSocket]:
    """Return the sockets of the horizon's, the zenith's and the ground's colour."""
    return [world.node_tree.nodes[node].inputs[socket] for node, socket in COLOURS]


def colours(sky: Sky) -> list[tuple]:
    """Return the colours for `sockets`."""
    zenith, horizon, ground = astuple(sky)
    return [(*to_working(colour), 1.0) for colour in (horizon, zenith, ground)]


def _background(tree) -> bpy.types.Node:
    return next(node for node in tree.nodes if node.type == 'BACKGROUND')


def _mix(tree, name: str, inputs: dict, x: float) -> bpy.types.Node:
    return add(tree, 'ShaderNodeMix', inputs, data_type='RGBA', name=name, label=name, location=(x, 0))
