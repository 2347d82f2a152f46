# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group WildCap Skin: a Principled BSDF set up as skin, with the few sockets an artist turns.

Sockets are addressed by name, which is the same from Blender 4.2 to 5.x.
"""

import bpy

NAME = "WildCap Skin"
VERSION = 1

SCATTERING_M = 0.0037
"""Mean free path of red light in skin, 3.7 mm (Jensen et al. 2001, skin1: 3.67, 1.37 and 0.68 mm)"""
SCATTERING_RGB = (1.0, 0.37, 0.19)

SPECULAR_AMOUNT = 1.44
"""The specular map holds levels for an IOR of 1.5 (4 % at normal incidence); at skin's 1.4 (2.8 %) the same light needs 4 / 2.8 as much"""

# name, socket type, default, range; what the maps feed comes first
INPUTS = (
    ("Albedo", 'NodeSocketColor', (0.5, 0.35, 0.28, 1.0), None),
    ("Specular", 'NodeSocketFloat', 0.5, (0.0, 1.0)),
    ("Normal", 'NodeSocketVector', (0.0, 0.0, 0.0), None),
    ("Specular Amount", 'NodeSocketFloat', SPECULAR_AMOUNT, (0.0, 4.0)),
    ("Roughness", 'NodeSocketFloat', 0.45, (0.0, 1.0)),
    ("IOR", 'NodeSocketFloat', 1.4, (1.0, 3.0)),
    ("Subsurface", 'NodeSocketFloat', 1.0, (0.0, 1.0)),
    ("Subsurface Scale", 'NodeSocketFloat', SCATTERING_M, (0.0, 10.0)),
)


def skin_group() -> bpy.types.NodeTree:
    """The group, made once per file; one of an older version is rebuilt inside, its sockets and their values stay."""
    group = bpy.data.node_groups.get(NAME)
    if group is None:
        group = bpy.data.node_groups.new(NAME, 'ShaderNodeTree')
    if group.get("wildcap_version") != VERSION:
        _sockets(group)
        _nodes(group)
        group["wildcap_version"] = VERSION
    return group


def _sockets(group) -> None:
    present = {item.name for item in group.interface.items_tree if item.item_type == 'SOCKET'}
    for name, kind, default, limits in INPUTS:
        if name in present:
            continue
        socket = group.interface.new_socket(name, in_out='INPUT', socket_type=kind)
        socket.default_value = default
        socket.hide_value = name == "Normal"
        if limits:
            socket.min_value, socket.max_value = limits
    if "BSDF" not in present:
        group.interface.new_socket("BSDF", in_out='OUTPUT', socket_type='NodeSocketShader')


def _nodes(group) -> None:
    nodes, links = group.nodes, group.links
    nodes.clear()
    source = nodes.new('NodeGroupInput')
    amount = nodes.new('ShaderNodeMath')
    shader = nodes.new('ShaderNodeBsdfPrincipled')
    result = nodes.new('NodeGroupOutput')
    for node, x in ((source, -500), (amount, -250), (shader, 0), (result, 320)):
        node.location = (x, 0)
    amount.operation = 'MULTIPLY'
    amount.use_clamp = True
    shader.subsurface_method = 'RANDOM_WALK'
    shader.inputs["Subsurface Radius"].default_value = SCATTERING_RGB
    links.new(source.outputs["Specular"], amount.inputs[0])
    links.new(source.outputs["Specular Amount"], amount.inputs[1])
    links.new(amount.outputs[0], shader.inputs["Specular IOR Level"])
    for name, socket in (("Albedo", "Base Color"), ("Normal", "Normal"), ("Roughness", "Roughness"), ("IOR", "IOR"),
                         ("Subsurface", "Subsurface Weight"), ("Subsurface Scale", "Subsurface Scale")):
        links.new(source.outputs[name], shader.inputs[socket])
    links.new(shader.outputs["BSDF"], result.inputs["BSDF"])
