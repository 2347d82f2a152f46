# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble Material: the capture's maps, each with its colour space, into WildCap Skin on the head. Again in place,
keeping values.

    UV Map -> Albedo (sRGB), Specular (Non-Color), Normal (Non-Color) -> Normal Map -> WildCap Skin -> Material Output
              Displacement (Non-Color, where the scan gave one) and the regions' attribute -> WildCap Skin
"""

from math import isclose
from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps
from .. import captures, data_blocks, head, node_trees
from . import asset, node_group, regions

KEY = "wildcap_skin"
IMAGES = (
    ("WildCap Albedo", "diffuse_albedo.png", False),
    ("WildCap Specular", "specular_albedo.png", True),
    ("WildCap Normal", "normal.png", True),
)
"""Node, its file, and whether that holds data, no colours."""
DISPLACEMENT = ("WildCap Displacement", "displacement.exr", True)
MADE = "wildcap_made"
"""Where the material keeps what it was when it was assembled."""
SET = "wildcap_set"
"""Where the material keeps what was set by itself: a value that is another one now is the artist's"""


def assemble(context, item) -> tuple[bpy.types.Material, str]:
    """The skin material on the capture's head, from the 4K maps where they are of the last solve, else from the solved
    ones; and what else belongs to a finished head, with what is to be told of that."""
    capture = captures.folder(item)
    obj = captures.require_head(context, item)
    maps = find_newest_maps(capture)
    missing = [path.name for path in maps if not path.is_file()]
    if missing:
        raise Problem(f"This capture has no {', '.join(missing)} yet.", "Click Solve first.")
    material = _material(obj)
    before = _set_before(material)
    regions.write(obj.data)
    height = capture.delivery / DISPLACEMENT[1]
    _build(material, {path.name: path for path in (*maps, height) if path.is_file()}, obj)
    _set(
        material,
        {
            "Specular Amount": _specular_amount(capture),
            "Subsurface Scale": node_group.SCATTERING_M * data_blocks.scale_of(obj),
        },
        before,
    )
    obj["wildcap_maps_time"] = max(path.stat().st_mtime for path in maps)
    try:
        told = head.complete(obj, capture)
    finally:  # the maps are in, whatever is wrong with the rest of the head
        material[MADE] = node_trees.fingerprint(material, head.PREVIEW)
    return material, told


def is_edited(obj) -> bool:
    """Whether the head's material is somebody's own, or not as Assemble Material left it."""
    current = obj.data.materials[0] if obj.data.materials else None
    if current is None or _is_preview(current):
        return False
    return current.get(MADE) != node_trees.fingerprint(current, head.PREVIEW)


def _is_preview(material) -> bool:
    """Whether it is what Bring In Head made to show the texture, as it made it."""
    made = material.get(head.TEXTURE_KEY)
    return KEY not in material and bool(made) and made == node_trees.fingerprint(material, head.PREVIEW)


def _material(obj) -> bpy.types.Material:
    """The head's skin material; somebody else's material in the first slot is replaced on this head only, never
    changed. Of a skin that another face has, too, the head gets a copy, with all that was set in it."""
    slots = obj.data.materials
    current = slots[0] if slots else None
    if current is not None:
        if KEY in current and _is_another_face_s(current, obj):
            current = slots[0] = current.copy()
        if KEY in current or _is_preview(current):
            return current
        current.use_fake_user = True  # it may have no other head
    material = bpy.data.materials.new(f"{obj.name} Skin")
    node_trees.of(material)  # for _build, which leaves a material that the artist switched to plain colours as it is
    if slots:
        slots[0] = material
    else:
        slots.append(material)
    return material


def _is_another_face_s(material, obj) -> bool:
    return any(
        other.data.materials[:1] == [material] and other.get(captures.HEAD_KEY) != obj.get(captures.HEAD_KEY)
        for other in bpy.data.objects
        if other.type == 'MESH' and captures.HEAD_KEY in other
    )


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
    group = node_group.skin_group()
    if skin.node_tree is None:
        skin.node_tree = group
        skin.width = 200
    asset.mark(group)
    uv = _node(tree, "WildCap UV", 'ShaderNodeUVMap', (-760, 0))
    uv.uv_map = obj.data.uv_layers[0].name
    for row, (name, file_name, data) in enumerate((*IMAGES, DISPLACEMENT)):
        if file_name not in paths:
            if name in tree.nodes and not _has_picture(tree.nodes[name]):
                tree.nodes.remove(tree.nodes[name])  # Cycles would take what is missing for a height of 0.3 m
            continue
        is_new = name not in tree.nodes
        if file_name == DISPLACEMENT[1] and is_new:
            material.displacement_method = 'DISPLACEMENT'  # the surface itself moves, once the socket says so
        node = _node(tree, name, 'ShaderNodeTexImage', (-540, 300 - 300 * row))
        node.image = head.load_image(paths[file_name], data)
        if is_new:  # the map's upper and lower border are crown and neck, which are not to mix
            node.interpolation, node.extension = 'Cubic', 'EXTEND'
        _link(tree, uv.outputs["UV"], node.inputs["Vector"])
    normal = _node(tree, "WildCap Normal Map", 'ShaderNodeNormalMap', (-200, -300))
    normal.space = 'TANGENT'
    normal.uv_map = obj.data.uv_layers[0].name
    attribute = _node(tree, "WildCap Regions", 'ShaderNodeAttribute', (-200, -520))
    attribute.attribute_name = regions.ATTRIBUTE
    output = next((n for n in tree.nodes if n.type == 'OUTPUT_MATERIAL'), None)
    output = output or _node(tree, "Material Output", 'ShaderNodeOutputMaterial', (340, 0))
    for source, socket, target, name in (
        ("WildCap Albedo", "Color", skin, "Albedo"),
        ("WildCap Specular", "Color", skin, "Specular"),
        ("WildCap Normal", "Color", normal, "Color"),
        ("WildCap Normal Map", "Normal", skin, "Normal"),
        ("WildCap Skin", "BSDF", output, "Surface"),
        ("WildCap Regions", "Fac", skin, "Region"),
        ("WildCap Displacement", "Color", skin, "Height"),
        ("WildCap Skin", "Displacement", output, "Displacement"),
    ):
        if source in tree.nodes and (name != "Displacement" or "WildCap Displacement" in tree.nodes):
            outputs = tree.nodes[source].outputs
            # its name from Blender 5 on
            _link(tree, outputs["Factor" if socket == "Fac" and "Factor" in outputs else socket], target.inputs[name])
    tree.nodes.active = tree.nodes["WildCap Albedo"]  # what Solid shading shows
    material[KEY] = True


def _has_picture(node) -> bool:
    """Whether the picture of an image node is in the .blend or on the disk."""
    image = node.image
    return image is not None and (
        image.packed_file is not None
        or image.source != 'FILE'
        or Path(bpy.path.abspath(image.filepath, library=image.library)).is_file()
    )


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


def _set_before(material) -> dict[str, float]:
    """What Assemble Material set the last time; {} for a material that is new."""
    return material[SET].to_dict() if SET in material else {}


def _set(material, inputs: dict[str, float], before: dict[str, float]) -> None:
    """Sets sockets of the skin to what this capture and the head's size ask for, but for those that the artist changed
    since."""
    sockets = material.node_tree.nodes["WildCap Skin"].inputs
    for name, value in inputs.items():
        if name not in before or isclose(sockets[name].default_value, before[name], rel_tol=1e-4):
            sockets[name].default_value = value
    material[SET] = inputs


def _specular_amount(capture: Capture) -> float:
    """What makes the mean of cheeks and forehead a Specular IOR Level of one half, by the worker's figure."""
    figures = capture.read()["stages"].get("upscale", {}).get("figures", {})
    return 0.5 / (figures.get("specular_mean") or node_group.TYPICAL_SPECULAR)
