# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble Material: the capture's maps, each with its colour space, into WildCap Skin on the head. Again in place, keeping values.

    UV Map -> Albedo (sRGB), Specular (Non-Color), Normal (Non-Color) -> Normal Map -> WildCap Skin -> Material Output
"""

import bpy

from ...core.messages import Problem
from .. import captures, head, status
from . import node_group

KEY = "wildcap_skin"
IMAGES = (
    ("WildCap Albedo", "diffuse_albedo.png", False),
    ("WildCap Specular", "specular_albedo.png", True),
    ("WildCap Normal", "normal.png", True),
)
"""Node, its file, and whether that holds data, no colours."""


def assemble(context, item) -> bpy.types.Material:
    """The skin material on the capture's head, from the 4K maps where they are newest, else from the solved ones."""
    capture = captures.folder(item)
    obj = captures.require_head(context, item)
    maps = status.delivered(capture)
    missing = [path.name for path in maps if not path.is_file()]
    if missing:
        raise Problem(f"This capture has no {', '.join(missing)} yet.", "Click Solve first.")
    material = _material(obj)
    _build(material, {path.name: path for path in maps}, obj)
    obj["wildcap_maps_time"] = max(path.stat().st_mtime for path in maps)
    return material


def _material(obj) -> bpy.types.Material:
    """The head's skin material; somebody else's material in the first slot is replaced on this head only, never changed."""
    slots = obj.data.materials
    current = slots[0] if slots else None
    if current is not None and (KEY in current or current.get("wildcap_texture")):
        return current
    material = bpy.data.materials.new(f"{obj.name} Skin")
    material.use_nodes = True
    if slots:
        slots[0] = material
    else:
        slots.append(material)
    return material


def _build(material, paths: dict, obj) -> None:
    tree = material.node_tree
    preview = tree.nodes.get(head.PREVIEW)  # the maps are here: what showed them on the way goes
    if preview is not None:
        image = preview.image
        tree.nodes.remove(preview)
        if image is not None and image.users == 0:
            bpy.data.images.remove(image)
    if KEY not in material:
        tree.nodes.clear()  # ours and new: a preview of the texture, or Blender's default
    skin = _node(tree, "WildCap Skin", 'ShaderNodeGroup', (80, 0))
    if skin.node_tree is None:
        skin.node_tree = node_group.skin_group()
        skin.width = 200
        skin.inputs["Subsurface Scale"].default_value = node_group.SCATTERING_M * _scale(obj)
    else:
        node_group.skin_group()
    uv = _node(tree, "WildCap UV", 'ShaderNodeUVMap', (-760, 0))
    uv.uv_map = obj.data.uv_layers[0].name
    for row, (name, file_name, data) in enumerate(IMAGES):
        node = _node(tree, name, 'ShaderNodeTexImage', (-540, 300 - 300 * row))
        node.image = head.load_image(paths[file_name], data)
        node.interpolation = 'Cubic' if node.interpolation == 'Linear' and KEY not in material else node.interpolation
        _link(tree, uv.outputs["UV"], node.inputs["Vector"])
    normal = _node(tree, "WildCap Normal Map", 'ShaderNodeNormalMap', (-200, -300))
    normal.space = 'TANGENT'
    normal.uv_map = obj.data.uv_layers[0].name
    output = next((n for n in tree.nodes if n.type == 'OUTPUT_MATERIAL'), None) or _node(tree, "Material Output", 'ShaderNodeOutputMaterial', (340, 0))
    for source, socket, target, name in (
        ("WildCap Albedo", "Color", skin, "Albedo"), ("WildCap Specular", "Color", skin, "Specular"),
        ("WildCap Normal", "Color", normal, "Color"), ("WildCap Normal Map", "Normal", skin, "Normal"), ("WildCap Skin", "BSDF", output, "Surface"),
    ):
        _link(tree, tree.nodes[source].outputs[socket], target.inputs[name])
    tree.nodes.active = tree.nodes["WildCap Albedo"]  # what Solid shading shows
    material[KEY] = True


def _node(tree, name: str, kind: str, location):
    node = tree.nodes.get(name)
    if node is None:
        node = tree.nodes.new(kind)
        node.name = node.label = name
        node.location = location
    return node


def _link(tree, output, socket) -> None:
    """Connects what nothing is connected to: an artist's own nodes in between stay."""
    if not socket.is_linked:
        tree.links.new(output, socket)


def _scale(obj) -> float:
    """How large the head is against metres: scattering keeps its size on skin."""
    return sum(obj.matrix_world.to_scale()) / 3


def as_text(tree, indent: str = "") -> list[str]:
    """A node tree as sorted lines (nodes with images, colour spaces and values; links): two trees are equal if these are."""
    lines = []
    for node in tree.nodes:
        details = []
        if getattr(node, "image", None) is not None:
            details.append(f"{bpy.path.basename(node.image.filepath)} {node.image.colorspace_settings.name}")
        if hasattr(node, "uv_map"):
            details.append(node.uv_map)
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            if isinstance(value, float) and not socket.is_linked:
                details.append(f"{socket.name}={value:.4g}")
        lines.append(f"{indent}{node.bl_idname} {node.name}: {', '.join(details)}")
        if getattr(node, "node_tree", None) is not None:
            lines += as_text(node.node_tree, f"{indent}{node.name} / ")
    lines += [f"{indent}{link.from_node.name}.{link.from_socket.name} -> {link.to_node.name}.{link.to_socket.name}" for link in tree.links]
    return sorted(lines)
