# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The world of the relight scene: a gradient from horizon to zenith, over a ground.

Radiance is linear in the sine of the elevation: with a zenith three times as bright as the horizon that is the overcast
sky of Moon and Spencer (1942), the CIE's traditional one.
"""

from dataclasses import astuple, dataclass

import bpy
from mathutils import Matrix

from .. import node_trees
from ..colours import to_working
from ..data_blocks import find, stop_animation

WORLD = "WildCap Relight"
HORIZON_BLEND = 0.04
"""Sine of the elevation above and below the horizon over which ground and sky meet."""
COLOURS = ("WildCap Sky", "A"), ("WildCap Sky", "B"), ("WildCap Ground", "A")
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
    background = next(n for n in tree.nodes if n.type == 'BACKGROUND')
    background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    background.inputs["Strength"].default_value = 1.0
    sky_world.cycles.sampling_method = 'AUTOMATIC'
    return sky_world


def show(world: bpy.types.World, sky: Sky, frame: Matrix) -> None:
    """Make the sky the world's background, upright with the head at `frame` [4, 4]."""
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(n for n in nodes if n.type == 'BACKGROUND')
    coordinates = _node(nodes, 'ShaderNodeTexCoord', -1100)
    upright = _node(nodes, 'ShaderNodeMapping', -920)
    split = _node(nodes, 'ShaderNodeSeparateXYZ', -740)
    rise = _node(nodes, 'ShaderNodeClamp', -560)
    edge = _node(nodes, 'ShaderNodeMapRange', -560, -160)
    above, below = _mix(nodes, "WildCap Sky", -380), _mix(nodes, "WildCap Ground", -200)
    upright.inputs["Rotation"].default_value = frame.to_quaternion().inverted().to_euler()
    edge.inputs["From Min"].default_value, edge.inputs["From Max"].default_value = -HORIZON_BLEND, HORIZON_BLEND
    links.new(coordinates.outputs["Generated"], upright.inputs["Vector"])
    links.new(upright.outputs["Vector"], split.inputs["Vector"])
    links.new(split.outputs["Z"], rise.inputs["Value"])
    links.new(split.outputs["Z"], edge.inputs["Value"])
    links.new(rise.outputs["Result"], above.inputs[0])
    links.new(edge.outputs["Result"], below.inputs[0])
    links.new(_colour(above, "Result", 'outputs'), _colour(below, "B"))
    links.new(_colour(below, "Result", 'outputs'), background.inputs["Color"])
    # it is smooth, and a fine importance map would take a second to compute
    world.cycles.sampling_method, world.cycles.sample_map_resolution = 'MANUAL', 128
    for socket, colour in zip(sockets(world), colours(sky), strict=True):
        socket.default_value = colour


def sockets(world: bpy.types.World) -> list[bpy.types.NodeSocket]:
    """Return the sockets of the horizon's, the zenith's and the ground's colour."""
    return [_colour(world.node_tree.nodes[node], name) for node, name in COLOURS]


def colours(sky: Sky) -> list[tuple]:
    """Return the colours for `sockets`."""
    zenith, horizon, ground = astuple(sky)
    return [(*to_working(colour), 1.0) for colour in (horizon, zenith, ground)]


def _node(nodes, kind: str, x: float, y: float = 0) -> bpy.types.Node:
    node = nodes.new(kind)
    node.location = (x, y)
    return node


def _mix(nodes, name: str, x: float) -> bpy.types.Node:
    node = _node(nodes, 'ShaderNodeMix', x)
    node.name = node.label = name
    node.data_type = 'RGBA'
    return node


def _colour(node, name: str, side: str = 'inputs') -> bpy.types.NodeSocket:
    """Return a mix node's socket for colours: each name occurs for every data type."""
    return next(s for s in getattr(node, side) if s.name == name and s.type == 'RGBA')
