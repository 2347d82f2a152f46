# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes of materials and worlds.

From Blender 5.0 on they always exist, and enabling them is deprecated.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager

import bpy


def of(block: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """Return the node tree of a material or a world, enabled."""
    if bpy.app.version < (5, 0, 0):
        block.use_nodes = True
    return block.node_tree


def principled(material: bpy.types.Material) -> bpy.types.Node:
    """Return the Principled BSDF of a material that has one."""
    return next(node for node in of(material).nodes if node.type == 'BSDF_PRINCIPLED')


def add(tree: bpy.types.NodeTree, kind: str, inputs: dict | tuple = (), **settings) -> bpy.types.Node:
    """Add a node with its settings and its inputs, as `feed` takes them."""
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    feed(node, inputs)
    return node


def feed(node: bpy.types.Node, inputs: dict | tuple) -> None:
    """Set a node's inputs, by index or name: link a socket, or set a value."""
    for name, value in inputs.items() if isinstance(inputs, dict) else enumerate(inputs):
        if isinstance(value, bpy.types.NodeSocket):
            node.id_data.links.new(value, node.inputs[name])
        else:
            node.inputs[name].default_value = value


@contextmanager
def keeping_fingerprint(material: bpy.types.Material, key: str, without: str) -> Iterator[None]:
    """Change a material of ours; one that was as its fingerprint in the custom property `key` has it stays so."""
    was_ours = key in material and material[key] == fingerprint(material, without)
    yield
    if was_ours:
        material[key] = fingerprint(material, without)


def fingerprint(material: bpy.types.Material, without: str) -> str:
    """Return a digest of a material's nodes, values and links, except images, positions and the node `without`."""
    if material.node_tree is None:
        return ""
    content = []
    for node in sorted(material.node_tree.nodes, key=lambda node: node.name):
        if node.name != without:
            defaults = [_plain(socket.default_value) for socket in node.inputs if hasattr(socket, "default_value")]
            links = [
                [link.from_node.name, link.from_socket.identifier] for socket in node.inputs for link in socket.links
            ]
            content.append([node.name, node.bl_idname, node.mute, defaults, links])
    return hashlib.blake2b(json.dumps(content).encode(), digest_size=16).hexdigest()


def _plain(value):
    if isinstance(value, float):
        return round(value, 5)
    if isinstance(value, (str, int)) or not hasattr(value, "__len__"):
        return str(value)
    return [round(float(component), 5) for component in value]
