# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Node group WildCap Skin: a Principled BSDF set up as skin, with the few sockets that an artist adjusts.

    Albedo x Tone, as far as Skin says, compensated for what scattering loses -> Base Color
    Specular x Specular Amount, clamped -> Specular IOR Level        Roughness x (1 + Region) -> Roughness
    Oil, where Region is smoother than the cheeks -> Coat Weight
    Height, Midlevel, Displacement -> Displacement, in the object's own units

Sockets are addressed by name, which is the same from Blender 4.2 to 5.x. A group of an older version is rebuilt inside:
sockets, their values, and an artist's own nodes and links stay.
"""

import bpy

from ...core.capture import skin_regions
from ..data_blocks import find

NAME = "WildCap Skin"
VERSION = 5

SCATTERING_M = 0.003
"""Mean free path of red light."""
SCATTERING_RGB = (1.0, 0.37, 0.19)
"""Mean free paths relative to red's (Jensen et al. 2001, skin1: 3.67, 1.37 and 0.68 mm)."""
GIVEN_BACK = (0.954, 0.932, 0.928)
"""Share of its Base Color that skin reflects under even light by Cycles's *Random Walk (Skin)*: the mean over six tones
of `python -m research.benchmarks.light.even_light`. The other random walk reflects 0.78 to 0.91."""
TYPICAL_SPECULAR = 0.35
"""Mean of an unmeasured specular map on cheeks and forehead. The map holds levels for an IOR of 1.5, of which 0.35 is
skin's 2.8 percent."""
OILY = skin_regions.ROUGHNESS["nose"]
"""Region of the nose, which gets a full coat of Oil; the forehead gets about two thirds, the cheeks none."""
SEBUM_IOR, SEBUM_ROUGHNESS = 1.47, 0.3
"""Index of what skin secretes (squalene 1.49, triglycerides 1.46); smoother than the skin below, by eye."""

FLOAT = 'NodeSocketFloat'
INPUTS = (
    ("Albedo", 'NodeSocketColor', (0.5, 0.35, 0.28, 1.0), None, "Diffuse albedo"),
    ("Specular", FLOAT, 0.5, (0.0, 1.0), "Specular albedo, as solved"),
    ("Normal", 'NodeSocketVector', (0.0, 0.0, 0.0), None, "The skin's relief"),
    (
        "Specular Amount",
        FLOAT,
        0.5 / TYPICAL_SPECULAR,
        (0.0, 10.0),
        "Times the specular albedo: the Specular IOR Level, at most 1. Half over the map's mean on cheeks and forehead "
        "gives these the 2.8 percent of skin",
    ),
    ("Roughness", FLOAT, 0.45, (0.0, 1.0), "Roughness of the cheeks; the other regions follow in their proportions"),
    ("IOR", FLOAT, 1.4, (1.0, 3.0), "Index of refraction; 1.4 reflects 2.8 percent at normal incidence"),
    ("Subsurface", FLOAT, 1.0, (0.0, 1.0), "How much of the diffuse light goes through the skin"),
    ("Subsurface Scale", FLOAT, SCATTERING_M, (0.0, 10.0), "Mean free path of red light: 3 mm at the head's size"),
    ("Region", FLOAT, 0.0, (-1.0, 1.0), "How much rougher than the cheeks this region is, as a share"),
    ("Height", FLOAT, 0.0, (-10.0, 10.0), "How far the surface stands out, in metres of the head's own space"),
    ("Displacement", FLOAT, 0.0, (0.0, 10.0), "Times the height; 1 is the scan's own relief, 0 is none"),
    ("Midlevel", FLOAT, 0.0, (-10.0, 10.0), "Height that displaces nothing"),
    (
        "Oil",
        FLOAT,
        0.0,
        (0.0, 1.0),
        "A thin shining film on nose, forehead, lids and lips. No capture tells how much there is: 0 is none",
    ),
    (
        "Tone",
        'NodeSocketColor',
        (1.0, 1.0, 1.0, 1.0),
        None,
        "Times the albedo of skin: from the tone of the maps to the one that was chosen",
    ),
    ("Skin", FLOAT, 1.0, (0.0, 1.0), "How far a place follows the tone: 1 is skin, 0 is hair"),
)
"""Name, socket type, default, range, tooltip; what the maps feed comes first."""
OUTPUTS = (("BSDF", 'NodeSocketShader'), ("Displacement", 'NodeSocketVector'))

NODES = (
    ("WildCap Input", 'NodeGroupInput', (-700, 0)),
    ("WildCap Tone", 'ShaderNodeMix', (-560, 340)),
    ("WildCap Given Back", 'ShaderNodeMix', (-400, 340)),
    ("WildCap Specular Level", 'ShaderNodeMath', (-400, 80)),
    ("WildCap Regions", 'ShaderNodeMath', (-400, -120)),
    ("WildCap Oily", 'ShaderNodeMath', (-400, -320)),
    ("WildCap Coat", 'ShaderNodeMath', (-200, -320)),
    ("WildCap Principled", 'ShaderNodeBsdfPrincipled', (0, 0)),
    ("WildCap Displacement", 'ShaderNodeDisplacement', (0, -420)),
    ("WildCap Output", 'NodeGroupOutput', (340, 0)),
)
"""Name, type, place."""
OPERATIONS = {
    "WildCap Specular Level": 'MULTIPLY',
    "WildCap Regions": 'MULTIPLY_ADD',
    "WildCap Oily": 'MULTIPLY',
    "WildCap Coat": 'MULTIPLY',
}
MIX_FACTOR, MIX_A, MIX_B, MIX_RESULT = 0, 6, 7, 2
"""Indices of a Mix node's sockets for colours: its names occur several times."""
LINKS = (
    ("WildCap Input", "Specular", "WildCap Specular Level", 0),
    ("WildCap Input", "Specular Amount", "WildCap Specular Level", 1),
    ("WildCap Specular Level", 0, "WildCap Principled", "Specular IOR Level"),
    ("WildCap Input", "Region", "WildCap Regions", 0),
    ("WildCap Input", "Roughness", "WildCap Regions", 1),
    ("WildCap Input", "Roughness", "WildCap Regions", 2),
    ("WildCap Regions", 0, "WildCap Principled", "Roughness"),
    ("WildCap Input", "Region", "WildCap Oily", 0),
    ("WildCap Oily", 0, "WildCap Coat", 0),
    ("WildCap Input", "Oil", "WildCap Coat", 1),
    ("WildCap Coat", 0, "WildCap Principled", "Coat Weight"),
    ("WildCap Input", "Skin", "WildCap Tone", MIX_FACTOR),
    ("WildCap Input", "Albedo", "WildCap Tone", MIX_A),
    ("WildCap Input", "Tone", "WildCap Tone", MIX_B),
    ("WildCap Input", "Subsurface", "WildCap Given Back", MIX_FACTOR),
    ("WildCap Tone", MIX_RESULT, "WildCap Given Back", MIX_A),
    ("WildCap Given Back", MIX_RESULT, "WildCap Principled", "Base Color"),
    ("WildCap Input", "Normal", "WildCap Principled", "Normal"),
    ("WildCap Input", "IOR", "WildCap Principled", "IOR"),
    ("WildCap Input", "Subsurface", "WildCap Principled", "Subsurface Weight"),
    ("WildCap Input", "Subsurface Scale", "WildCap Principled", "Subsurface Scale"),
    ("WildCap Principled", "BSDF", "WildCap Output", "BSDF"),
    ("WildCap Input", "Height", "WildCap Displacement", "Height"),
    ("WildCap Input", "Midlevel", "WildCap Displacement", "Midlevel"),
    ("WildCap Input", "Displacement", "WildCap Displacement", "Scale"),
    ("WildCap Displacement", "Displacement", "WildCap Output", "Displacement"),
)


def skin_group() -> bpy.types.NodeTree:
    """Return the group, made once per file; one of an older version is rebuilt inside."""
    group = find(bpy.data.node_groups, NAME)
    if group is None:
        group = bpy.data.node_groups.new(NAME, 'ShaderNodeTree')
    if group.get("wildcap_version") != VERSION:
        _sockets(group)
        _set_up(_nodes(group))
        _wire(group)
        group["wildcap_version"] = VERSION
    return group


def _sockets(group) -> None:
    present = {(item.in_out, item.name): item for item in group.interface.items_tree if item.item_type == 'SOCKET'}
    for name, kind, default, limits, tooltip in INPUTS:
        socket = present.get(('INPUT', name))
        if socket is None:
            socket = group.interface.new_socket(name, in_out='INPUT', socket_type=kind)
            socket.default_value = default
            socket.hide_value = name == "Normal"
        socket.description = tooltip
        if limits:
            socket.min_value, socket.max_value = limits
    for name, kind in OUTPUTS:
        if ('OUTPUT', name) not in present:
            group.interface.new_socket(name, in_out='OUTPUT', socket_type=kind)


def _nodes(group) -> dict[str, bpy.types.Node]:
    """Return our nodes by name, made where they are missing."""
    for name, kind, location in NODES:
        if name not in group.nodes:
            node = group.nodes.new(kind)
            node.name = node.label = name
            node.location = location
    return {name: group.nodes[name] for name, *_ in NODES}


def _set_up(nodes: dict[str, bpy.types.Node]) -> None:
    for name, operation in OPERATIONS.items():
        nodes[name].operation, nodes[name].use_clamp = operation, name != "WildCap Coat"
    nodes["WildCap Oily"].inputs[1].default_value = 1 / OILY
    shader = nodes["WildCap Principled"]
    if not _is_theirs(shader.inputs["Coat Weight"]):
        shader.inputs["Coat IOR"].default_value = SEBUM_IOR
        shader.inputs["Coat Roughness"].default_value = SEBUM_ROUGHNESS
    shader.subsurface_method = 'RANDOM_WALK_SKIN'
    shader.inputs["Subsurface Radius"].default_value = SCATTERING_RGB
    tone, back = nodes["WildCap Tone"], nodes["WildCap Given Back"]
    for mix in (tone, back):
        mix.data_type, mix.blend_type = 'RGBA', 'MULTIPLY'
    tone.clamp_result = True
    back.inputs[MIX_B].default_value = (*(1 / share for share in GIVEN_BACK), 1)
    nodes["WildCap Displacement"].space = 'OBJECT'  # heights grow with the object's scale


def _wire(group) -> None:
    """Link our nodes with each other, except for inputs that are the artist's."""
    for source, output, target, socket in LINKS:
        into = group.nodes[target].inputs[socket]
        if not _is_theirs(into):
            group.links.new(group.nodes[source].outputs[output], into)


def _is_theirs(socket) -> bool:
    """Return whether an artist's node feeds a socket of ours, or they gave the skin a coat."""
    if socket.is_linked:
        return socket.links[0].from_node.name not in {name for name, *_ in NODES}
    return socket.name == "Coat Weight" and socket.default_value > 0
