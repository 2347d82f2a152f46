# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from a picture of the surroundings (HDRI): a world of Blender's, one of the preferences' lights, or a file."""

from dataclasses import dataclass
from math import tau
from pathlib import Path
from zlib import crc32

import bpy

from ..core.capture.messages import Problem

_items: list[tuple[str, str, str, int, int]] = []  # Blender keeps no reference to the strings of a dynamic enum


@dataclass(frozen=True)
class Hdri:
    """Equirectangular picture of the surroundings, times `strength`."""

    path: Path
    strength: float = 1.0


def items(self, context):
    """Return the worlds that Blender knows, its own eight (CC0) and the artist's, for an EnumProperty."""
    # a file stores the number: the place in the list would mean another world in another Blender
    choices = [
        (light.name, Path(light.name).stem.replace("_", " ").title(), "", 0, crc32(light.name.encode()) & 0x7FFFFFFF)
        for light in _worlds()
    ]
    _items[:] = choices or [('NONE', "None", "This Blender has none", 0, 0)]
    return _items


def light(props) -> str | Hdri:
    """Return the light of the scene's settings: a preset's name, or a picture."""
    return chosen_hdri(props) if props.light == 'hdri' else props.light


def named(name: str) -> Hdri:
    """Return a world by its file's name with or without the suffix. Raises Problem if there is none."""
    for world in _worlds():
        if name in (world.name, Path(world.name).stem):
            return Hdri(Path(world.path))
    raise Problem(
        f"There is no light named {name}.",
        f"Blender's worlds here are {', '.join(sorted(Path(world.name).stem for world in _worlds()))}.",
    )


def chosen_hdri(props) -> Hdri:
    """Return the picture of the scene's settings. Raises Problem if there is none."""
    path = (
        Path(bpy.path.abspath(props.hdri_file))
        if props.hdri_file
        else next((Path(light.path) for light in _worlds() if props.hdri in (light.name, "")), None)
    )
    if path is None:
        raise Problem("This Blender came without pictures of surroundings.", "Choose an HDRI file of your own.")
    if not path.is_file():
        raise Problem(
            f"There is no picture at {path}.", "Choose another HDRI file, or empty the field for one of Blender's."
        )
    return Hdri(path, props.hdri_strength)


def light_with(world: bpy.types.World, hdri: Hdri, turned: float) -> None:
    """Make the picture the world's background, turned about +Z by `turned` radians, counter-clockwise from above."""
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(n for n in nodes if n.type == 'BACKGROUND')
    coordinates, mapping, picture = (
        nodes.new(kind) for kind in ('ShaderNodeTexCoord', 'ShaderNodeMapping', 'ShaderNodeTexEnvironment')
    )
    for node, x in ((coordinates, -900), (mapping, -700), (picture, -450)):
        node.location = (x, 0)
    # Turning the coordinates one way turns the surroundings the other way.
    mapping.inputs["Rotation"].default_value = (0, 0, -(turned % tau))
    picture.image = bpy.data.images.load(str(hdri.path), check_existing=True)
    background.inputs["Strength"].default_value = hdri.strength
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    links.new(picture.outputs["Color"], background.inputs["Color"])


def _worlds():
    return [light for light in bpy.context.preferences.studio_lights if light.type == 'WORLD']
