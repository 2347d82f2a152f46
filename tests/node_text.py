# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A node tree as text, the same in every Blender: two trees are equal if their texts are."""

import bpy


def lines(tree, indent: str = "") -> list[str]:
    """Sorted lines: nodes with images, colour spaces, and those options and values that a new node of the kind has not;
    links; groups within."""
    found = [f"{indent}{node.bl_idname} {node.name}: {', '.join(_details(node))}".rstrip(": ") for node in tree.nodes]
    for node in tree.nodes:
        if getattr(node, "node_tree", None) is not None:
            found += lines(node.node_tree, f"{indent}{node.name} / ")
    found += [
        f"{indent}{link.from_node.name}.{_name(link.from_socket)} -> {link.to_node.name}.{_name(link.to_socket)}"
        for link in tree.links
    ]
    return sorted(found)


OPTIONS = (
    "operation",
    "use_clamp",
    "subsurface_method",
    "space",
    "attribute_name",
    "interpolation",
    "extension",
    "uv_map",
)
RENAMED = {"Factor": "Fac"}  # in Blender 5


def _name(socket) -> str:
    return RENAMED.get(socket.name, socket.name)


def _details(node) -> list[str]:
    scratch = bpy.data.node_groups.new("scratch", 'ShaderNodeTree')
    try:
        fresh = scratch.nodes.new(node.bl_idname)
        image = getattr(node, "image", None)
        pictures = (
            [f"{bpy.path.basename(image.filepath)} {image.colorspace_settings.name}"] if image is not None else []
        )
        options = [
            f"{name}={getattr(node, name)}"
            for name in OPTIONS
            if hasattr(node, name) and getattr(node, name) != getattr(fresh, name)
        ]
        # a group node of no group has no sockets
        usual = [_value(socket) for socket in fresh.inputs] + [None] * len(node.inputs)
        values = [
            f"{_name(socket)}={_value(socket)}"
            for socket, other in zip(node.inputs, usual, strict=False)
            if not socket.is_linked and _value(socket) and _value(socket) != other
        ]
        return pictures + options + values
    finally:
        bpy.data.node_groups.remove(scratch)


def _value(socket) -> str:
    value = getattr(socket, "default_value", None)
    if isinstance(value, (int, float)):
        return f"{value:.4g}"
    return " ".join(f"{v:.4g}" for v in value) if hasattr(value, "__len__") and not isinstance(value, str) else ""
