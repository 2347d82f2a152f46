# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble Material: put the capture's maps, each in its colour space, into WildCap Skin on the head, in place.

UV Map -> Albedo (sRGB), Specular (Non-Color), Normal (Non-Color) -> Normal Map -> WildCap Skin -> Material Output
          Skin Weight (Non-Color), how far each place follows another skin tone (tone.py) -> WildCap Skin
          Displacement (Non-Color, if the scan gave one) and the regions' attribute -> WildCap Skin
"""

from math import isclose
from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps, find_skin_weight
from .. import captures, data_blocks, head, node_trees, toned_picture, tones
from . import asset, node_group, regions

KEY = "wildcap_skin"
SKIN, ALBEDO, WEIGHT = "WildCap Skin", "WildCap Albedo", "WildCap Skin Weight"
IMAGES = (
    ("WildCap Albedo", "diffuse_albedo.png", False),
    ("WildCap Specular", "specular_albedo.png", True),
    ("WildCap Normal", "normal.png", True),
)
"""Node, its file, and whether that holds data rather than colours."""
WEIGHT_IMAGE = (WEIGHT, "skin_weight.png", True)
DISPLACEMENT = ("WildCap Displacement", "displacement.exr", True)
WEIGHT_PLACE = (-540, -900)
MADE = "wildcap_made"
"""Custom property of the material: its fingerprint as it was assembled."""
WORN = "wildcap_tone"
"""Custom property of the material: the skin tone of its maps, sRGB."""
SET = "wildcap_set"
"""Custom property of the material: the values that were set; one that differs now is the artist's."""


def assemble(context, item) -> tuple[bpy.types.Material, str]:
    """Put the newest solved maps on the capture's head and complete it; return its material and a notice.

    Raises Problem if there are no maps.
    """
    capture = captures.folder(item)
    obj = captures.require_head(context, item)
    maps = find_newest_maps(capture)
    missing = [path.name for path in maps if not path.is_file()]
    if missing:
        raise Problem(f"This capture has no {', '.join(missing)} yet.", "Click Solve first.")
    material = _material(obj)
    before = material[SET].to_dict() if SET in material else {}
    regions.write(obj.data)
    height = capture.delivery / DISPLACEMENT[1]
    _build(material, {path.name: path for path in (*maps, height, find_skin_weight(capture)) if path.is_file()}, obj)
    worn = tones.of_maps(capture)
    if worn is not None:
        material[WORN] = worn.solved
    scattering = node_group.SCATTERING_M * data_blocks.scale_of(obj)
    _set(material, {"Specular Amount": _specular_amount(capture), "Subsurface Scale": scattering}, before)
    obj["wildcap_maps_time"] = max(path.stat().st_mtime for path in maps)
    try:
        notice = head.complete(obj, capture)
    finally:  # the maps are in, whatever is wrong with the rest of the head
        material[MADE] = node_trees.fingerprint(material, head.PREVIEW)
    tones.show_on(obj, capture)
    return material, notice


def feed_weight(material: bpy.types.Material, capture: Capture) -> None:
    """Feed the skin how far each place follows the tone, if nothing does; for old solves by a picture in the .blend."""
    tree = material.node_tree
    if tree.nodes[SKIN].inputs["Skin"].is_linked:
        return
    uv = tree.nodes.get("WildCap UV")
    path = find_skin_weight(capture)
    if path.is_file() and uv is not None:
        _add_map(material, WEIGHT_IMAGE, {WEIGHT_IMAGE[1]: path}, uv, WEIGHT_PLACE)
    else:
        node = _node(tree, WEIGHT, 'ShaderNodeTexImage', WEIGHT_PLACE)
        node.image = toned_picture.weight_image(material.name, capture)
        node.extension = 'EXTEND'
        if uv is not None:
            _link(tree, uv.outputs["UV"], node.inputs["Vector"])
    _link(tree, tree.nodes[WEIGHT].outputs["Color"], tree.nodes[SKIN].inputs["Skin"])


def is_edited(obj) -> bool:
    """Return whether the head's material is somebody's own, or was changed since it was assembled."""
    current = obj.data.materials[0] if obj.data.materials else None
    if current is None or _is_preview(current):
        return False
    return current.get(MADE) != node_trees.fingerprint(current, head.PREVIEW)


def _is_preview(material) -> bool:
    """Return whether a material is the unchanged one by which Bring In Head shows the texture."""
    digest = material.get(head.TEXTURE_KEY)
    return KEY not in material and bool(digest) and digest == node_trees.fingerprint(material, head.PREVIEW)


def _material(obj) -> bpy.types.Material:
    """Return the head's skin material, a new one in place of somebody else's, which is not changed.

    If another face has the same skin, the head gets a copy with all that was set in it.
    """
    slots = obj.data.materials
    current = slots[0] if slots else None
    if current is not None:
        if KEY in current and _is_another_face_s(current, obj):
            current = slots[0] = current.copy()
        if KEY in current or _is_preview(current):
            return current
        current.use_fake_user = True  # it may have no other user
    material = bpy.data.materials.new(f"{obj.name} Skin")
    node_trees.of(material)  # _build does not switch nodes on, which an artist may have switched off
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
    """Add the nodes that are missing and link what is not linked; paths: file name -> map."""
    tree = material.node_tree
    _remove_preview(tree)
    if KEY not in material:
        tree.nodes.clear()  # new, or ours: a preview of the texture
    skin = _node(tree, "WildCap Skin", 'ShaderNodeGroup', (80, 0))
    group = node_group.skin_group()
    if skin.node_tree is None:
        skin.node_tree = group
        skin.width = 200
    asset.mark(group)
    uv = _node(tree, "WildCap UV", 'ShaderNodeUVMap', (-760, 0))
    uv.uv_map = obj.data.uv_layers[0].name
    for row, image in enumerate((*IMAGES, DISPLACEMENT)):
        _add_map(material, image, paths, uv, (-540, 300 - 300 * row))
    _add_map(material, WEIGHT_IMAGE, paths, uv, WEIGHT_PLACE)
    normal = _node(tree, "WildCap Normal Map", 'ShaderNodeNormalMap', (-200, -300))
    normal.space, normal.uv_map = 'TANGENT', uv.uv_map
    attribute = _node(tree, "WildCap Regions", 'ShaderNodeAttribute', (-200, -520))
    attribute.attribute_name = regions.ATTRIBUTE
    output = next((n for n in tree.nodes if n.type == 'OUTPUT_MATERIAL'), None)
    output = output or _node(tree, "Material Output", 'ShaderNodeOutputMaterial', (340, 0))
    factor = "Factor" if "Factor" in attribute.outputs else "Fac"  # its name before Blender 5
    links = [
        ("WildCap Albedo", "Color", skin, "Albedo"),
        ("WildCap Specular", "Color", skin, "Specular"),
        ("WildCap Normal", "Color", normal, "Color"),
        ("WildCap Normal Map", "Normal", skin, "Normal"),
        ("WildCap Skin", "BSDF", output, "Surface"),
        ("WildCap Regions", factor, skin, "Region"),
        (WEIGHT, "Color", skin, "Skin"),
    ]
    if DISPLACEMENT[0] in tree.nodes:
        links += [(DISPLACEMENT[0], "Color", skin, "Height"), ("WildCap Skin", "Displacement", output, "Displacement")]
    for source, socket, target, name in links:
        if source in tree.nodes:
            _link(tree, tree.nodes[source].outputs[socket], target.inputs[name])
    tree.nodes.active = tree.nodes["WildCap Albedo"]  # what Solid shading shows
    material[KEY] = True


def _remove_preview(tree) -> None:
    """Remove the picture by which a running solve is shown."""
    preview = tree.nodes.get(head.PREVIEW)
    if preview is not None:
        image = preview.image
        tree.nodes.remove(preview)
        if image is not None and image.users == 0:
            bpy.data.images.remove(image)


def _add_map(material, image: tuple[str, str, bool], paths: dict, uv, location: tuple[float, float]) -> None:
    """Add a map's node, or remove that of a map that is gone."""
    tree, (name, file_name, is_data) = material.node_tree, image
    if file_name not in paths:
        if name in tree.nodes and not _has_picture(tree.nodes[name]):
            tree.nodes.remove(tree.nodes[name])  # Cycles would read a missing picture as a height of 0.3 m
        return
    is_new = name not in tree.nodes
    node = _node(tree, name, 'ShaderNodeTexImage', location)
    node.image = head.load_image(paths[file_name], is_data)
    if is_new:  # the map's upper and lower border are crown and neck, which must not mix
        node.interpolation, node.extension = 'Linear' if image == WEIGHT_IMAGE else 'Cubic', 'EXTEND'
        if image == DISPLACEMENT:
            material.displacement_method = 'DISPLACEMENT'  # the surface itself moves, once the socket says so
    _link(tree, uv.outputs["UV"], node.inputs["Vector"])


def _has_picture(node) -> bool:
    """Return whether the picture of an image node is in the .blend or on the disk."""
    image = node.image
    if image is None or image.packed_file is not None or image.source != 'FILE':
        return image is not None
    return Path(bpy.path.abspath(image.filepath, library=image.library)).is_file()


def _node(tree, name: str, kind: str, location):
    node = tree.nodes.get(name)
    if node is None:
        node = tree.nodes.new(kind)
        node.name = node.label = name
        node.location = location
    return node


def _link(tree, output, socket) -> None:
    """Connect a free socket: an artist's own nodes in between stay."""
    if not socket.is_linked:
        tree.links.new(output, socket)


def _set(material, inputs: dict[str, float], before: dict[str, float]) -> None:
    """Set sockets of the skin, except those that the artist changed since they were set `before`."""
    sockets = material.node_tree.nodes["WildCap Skin"].inputs
    for name, value in inputs.items():
        if name not in before or isclose(sockets[name].default_value, before[name], rel_tol=1e-4):
            sockets[name].default_value = value
    material[SET] = inputs


def _specular_amount(capture: Capture) -> float:
    """Return the factor that makes the mean of cheeks and forehead a Specular IOR Level of one half."""
    figures = capture.read()["stages"].get("upscale", {}).get("figures", {})
    return 0.5 / (figures.get("specular_mean") or node_group.TYPICAL_SPECULAR)
