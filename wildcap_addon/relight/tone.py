# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin tone on an assembled head: the skin of its maps times a gain, in the shader and in the picture for Solid.

A head remembers the tone of the maps it wears. A delivery bakes the same gain by the same weight of skin.
"""

import contextlib

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps
from ...core.capture.tone_choice import SAME, SolvedTone, find_chosen
from ...core.settings.colour_values import Colour, to_linear
from .. import colours, head, node_trees, toned_picture, tones
from . import node_group
from .material import ALBEDO, KEY, MADE, SKIN, WEIGHT, WORN, feed_weight

UNTONED = "filmed.png", "delit.png"
"""Pictures to compare the albedo with, which no tone changes."""


def wear(obj: bpy.types.Object, capture: Capture, chosen: Colour | None) -> None:
    """Give an assembled head a skin tone, None for that of its maps; the artist's own nodes and values stay."""
    material = obj.data.materials[0] if obj.data.materials else None
    if material is None or KEY not in material or SKIN not in material.node_tree.nodes:
        return
    with node_trees.keeping_fingerprint(material, MADE, head.PREVIEW):
        gain = _gain(material, capture, chosen)
        skin = material.node_tree.nodes[SKIN]
        if gain is not None and "Tone" not in skin.inputs:
            node_group.skin_group()  # of an older version
        if gain is not None:
            feed_weight(material, capture)
        if "Tone" in skin.inputs:
            of_shader = (1.0, 1.0, 1.0) if gain is None else _in_working_space(gain, _worn(material, capture))
            skin.inputs["Tone"].default_value = (*of_shader, 1.0)
        _show_in_solid(material, capture, gain)


def _gain(material: bpy.types.Material, capture: Capture, chosen: Colour | None) -> np.ndarray | None:
    """Return the linear gain [3] from the tone that a head wears to the chosen or estimated one; None for the same."""
    tone = _tone_of_maps(capture)
    worn = _worn(material, capture)
    if chosen is None and tone is not None:
        chosen = find_chosen("auto", tone)
    if _shown(material) in UNTONED or worn is None or chosen is None or np.abs(np.subtract(worn, chosen)).max() <= SAME:
        return None
    return np.array(to_linear(chosen)) / to_linear(worn)


def _tone_of_maps(capture: Capture) -> SolvedTone | None:
    with contextlib.suppress(Problem):
        return tones.of_maps(capture)
    return None


def _worn(material: bpy.types.Material, capture: Capture) -> Colour | None:
    """Return the tone of the maps that a material has, sRGB."""
    if WORN in material:
        return tuple(material[WORN])
    tone = _tone_of_maps(capture)
    return tone and tone.solved


def _shown(material: bpy.types.Material) -> str:
    """Return the file name of the picture in the albedo's place, '' without any."""
    node = material.node_tree.nodes.get(ALBEDO)
    image = node.image if node is not None else None
    return bpy.path.basename(image.filepath) if image is not None else ""


def _in_working_space(gain: np.ndarray, worn: Colour) -> tuple[float, ...]:
    """Return the gain from the same tone to the same in the scene's working space."""
    linear = np.array(to_linear(worn))
    return tuple(map(float, colours.to_working(linear * gain) / colours.to_working(linear)))


def _show_in_solid(material: bpy.types.Material, capture: Capture, gain: np.ndarray | None) -> None:
    nodes = material.node_tree.nodes
    newest = find_newest_maps(capture)[0]
    source = newest if newest.parent == capture.maps_retouched else capture.maps / toned_picture.ALBEDO
    shows_ours = nodes.active is not None and nodes.active.name in (ALBEDO, WEIGHT, toned_picture.NODE)
    if gain is None or not source.is_file() or _shown(material) != source.name:
        toned_picture.remove(material)
        if shows_ours and ALBEDO in nodes:
            nodes.active = nodes[ALBEDO]
        return
    active = nodes.active
    try:
        toned_picture.put(material, toned_picture.write(capture, source, gain), (-540, 600))
    except (Problem, OSError):  # a read-only capture: the shader shows the tone all the same
        return
    if active is not None and not shows_ours:
        nodes.active = active  # the artist looks at something else
