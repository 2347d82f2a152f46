# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves on a head, rooted in its UVs: they follow its face units, and Blender's own brushes comb them.

One object per part, a child of the head with the custom property captures.HAIR_KEY. A digest tells whether somebody
combed it since.
"""

import hashlib

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.interpolate import poly_3d_calc

from .. import captures, colours, head, local_view, node_trees
from ..data_blocks import find, new_child, read_field, replace_data

TITLES = {"brows": "Brows", "lashes": "Lashes", "beard": "Beard"}
GROWN, MATERIAL = "wildcap_grown", "wildcap_hair_material"
ROOT = "wildcap_root"
"""Attribute of each curve: the place of the skin to which it is rooted, in the head's axes."""
ROOTED_M = 0.01
"""Farther than this from its first point, no place is a hair's root."""
UVS = "surface_uv_coordinate"
ROUGHNESS, IOR = 0.4, 1.55
"""Surface of keratin, whose scales spread the highlight."""
INNER_TILE = 10
"""Offset of the UVs of what is no skin."""
DEFORM = "WildCap Hair on Head"


def of(obj) -> list[bpy.types.Object]:
    """Return the hair of a head, in the order of TITLES."""
    hairs = {hair[captures.HAIR_KEY]: hair for hair in captures.hair(obj)}
    return [hairs[part] for part in TITLES if part in hairs]


def grow_part(context, obj, part: str, points: np.ndarray, radius: np.ndarray, colour: np.ndarray) -> bool:
    """Put the hairs of a part on the head; combed ones only follow the skin, and the result is False.

    points: [M, K, 3] from the root on, metres in the head's axes; radius: [M, K], metres; colour: [M, 3], linear.
    """
    hair = next((child for child in of(obj) if child[captures.HAIR_KEY] == part), None)
    if hair is not None and is_combed(hair):
        follow(hair, obj)
        return False
    colour = colours.to_working(colour)
    data = _make(f"{obj.name} {TITLES[part]}", points, radius, colour)
    if hair is None:
        hair = new_child(obj, data.name, data)
        hair[captures.HAIR_KEY] = part
    else:
        replace_data(hair, data, bpy.data.hair_curves)
    if not data.materials:
        data.materials.append(_material(f"{obj.name} Hair", colour.mean(0)))
    _root(hair, obj)
    hair[GROWN] = _digest(data)
    local_view.join(context, [hair])
    return True


def is_combed(hair) -> bool:
    """Return whether hairs were moved, cut, added, thickened or coloured since they were grown."""
    return hair.get(GROWN) != _digest(hair.data)


def follow(hair, obj) -> None:
    """Move each hair as the skin under its root moved since it was rooted; what was combed stays.

    Hairs that a brush added since have no root yet: they are rooted where they are.
    """
    data, combed = hair.data, is_combed(hair)
    if ROOT not in data.attributes or UVS not in data.attributes or not data.curves:
        return
    data.surface_uv_map = _rooting_uvs(obj.data)
    offsets, position = _offsets(data), _read(data.attributes["position"], "vector", 3)
    first = position[offsets[:-1]]
    uv, before = _read(data.attributes[UVS], "vector", 2), _read(data.attributes[ROOT], "vector", 3)
    rooted = np.linalg.norm(before - first, axis=1) < ROOTED_M
    places = before.copy()
    places[rooted] = _places(obj.data, uv[rooted], before[rooted])
    uv[~rooted], places[~rooted] = _nearest(obj.data, first[~rooted])
    moved = np.where(rooted[:, None], places - before, 0)
    if rooted.all() and np.abs(moved).max() < 1e-6:
        return
    position += np.repeat(moved, np.diff(offsets), 0)
    for name, vectors in (("position", position), (ROOT, places), (UVS, uv)):
        data.attributes[name].data.foreach_set("vector", vectors.astype(np.float32).ravel())
    data.update_tag()
    if not combed:
        hair[GROWN] = _digest(data)


def _make(name: str, points: np.ndarray, radius: np.ndarray, colour: np.ndarray) -> bpy.types.Curves:
    count, knots = points.shape[:2]
    data = bpy.data.hair_curves.new(name)
    data.add_curves([knots] * count)
    rgba = np.concatenate([colour, np.ones((count, 1))], 1)
    _write(data, "position", 'FLOAT_VECTOR', 'POINT', "vector", points)
    _write(data, "radius", 'FLOAT', 'POINT', "value", radius)
    _write(data, captures.HAIR_COLOUR, 'FLOAT_COLOR', 'CURVE', "color", rgba)
    return data


def _root(hair, obj) -> None:
    """Bind each hair to the nearest place of the head's skin at rest, by its UVs."""
    data = hair.data
    roots = _read(data.attributes["position"], "vector", 3)[_offsets(data)[:-1]]
    uv, places = _nearest(obj.data, roots)
    _write(data, UVS, 'FLOAT2', 'CURVE', "vector", uv)
    _write(data, ROOT, 'FLOAT_VECTOR', 'CURVE', "vector", places)
    data.surface, data.surface_uv_map = obj, _rooting_uvs(obj.data)
    obj.add_rest_position_attribute = True  # hair is bent relative to it when the head moves
    if DEFORM not in hair.modifiers:
        hair.modifiers.new(DEFORM, 'NODES').node_group = _deform_group()


def _rooting_uvs(mesh) -> str:
    """Return the name of the UV map in which the skin is alone, made if there is none."""
    if head.OUTER in mesh and head.HAIR_UVS not in mesh.uv_layers:
        active = mesh.uv_layers.active_index
        uv = read_field(mesh.uv_layers[0].data, "uv", 2)
        uv[mesh.polygons[mesh[head.OUTER]].loop_start :] += INNER_TILE
        mesh.uv_layers.new(name=head.HAIR_UVS, do_init=False).data.foreach_set("uv", uv.ravel())
        mesh.uv_layers.active_index = active
    return head.HAIR_UVS if head.OUTER in mesh else mesh.uv_layers[0].name


def _nearest(mesh, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return UVs [M, 2] and places [M, 3] of the skin nearest to roots [M, 3]."""
    corners, places, uvs = _skin(mesh)
    tree = BVHTree.FromPolygons(places.tolist(), corners.tolist())
    uv, nearest = np.zeros((len(roots), 2)), np.zeros((len(roots), 3))
    for k, root in enumerate(roots.tolist()):
        place, _, face, _ = tree.find_nearest(root)
        weights = np.array(poly_3d_calc([Vector(places[i]) for i in corners[face]], place))
        uv[k], nearest[k] = weights @ uvs[face], place
    return uv, nearest


def _places(mesh, uv: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Return the places [M, 3] of UVs [M, 2] on the skin; `otherwise` [M, 3] where no triangle has them."""
    corners, places, uvs = _skin(mesh)
    flat = np.concatenate([uvs.reshape(-1, 2), np.zeros((3 * len(corners), 1))], 1)
    tree = BVHTree.FromPolygons(flat.tolist(), np.arange(len(flat)).reshape(-1, 3).tolist())
    positions = otherwise.copy()
    for k, (u, v) in enumerate(uv.tolist()):
        place, _, face, distance = tree.find_nearest((u, v, 0))
        if place is not None and distance < 1e-3:
            weights = np.array(poly_3d_calc([Vector(flat[3 * face + i]) for i in range(3)], place))
            positions[k] = weights @ places[corners[face]]
    return positions


def _skin(mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the skin at rest, without sockets, eyes and mouth: triangles [F, 3], vertices [V, 3], UVs [F, 3, 2]."""
    mesh.calc_loop_triangles()
    fields = ("vertices", 3), ("loops", 3), ("polygon_index", 1)
    corners, loops, polygons = (read_field(mesh.loop_triangles, field, width, np.int32) for field, width in fields)
    places = read_field(mesh.shape_keys.reference_key.data if mesh.shape_keys else mesh.vertices, "co", 3)
    uvs = read_field(mesh.uv_layers[0].data, "uv", 2)
    skin = polygons < mesh.get(head.OUTER, len(mesh.polygons))
    return corners[skin], places.astype(np.float64), uvs[loops[skin]].astype(np.float64)


def _deform_group() -> bpy.types.NodeTree:
    """Return the nodes by which curves follow the surface that they are rooted in, made once per file."""
    group = find(bpy.data.node_groups, DEFORM)
    if group is None:
        group = bpy.data.node_groups.new(DEFORM, 'GeometryNodeTree')
        group.is_modifier = True
        for side in ('INPUT', 'OUTPUT'):
            group.interface.new_socket("Geometry", in_out=side, socket_type='NodeSocketGeometry')
        curves = node_trees.add(group, 'NodeGroupInput').outputs[0]
        deform = node_trees.add(group, 'GeometryNodeDeformCurvesOnSurface', {"Curves": curves}, location=(200, 0))
        node_trees.add(group, 'NodeGroupOutput', (deform.outputs["Curves"],), location=(420, 0))
    return group


def _material(name: str, mean: np.ndarray) -> bpy.types.Material:
    """Return hair in its own colour, in Solid shading in the mean [3]; an existing one keeps the artist's changes.

    Opaque: what was measured is an albedo. Principled Hair's colour is that of a whole head of hair, by which single
    hairs over light skin look blond.
    """
    existing = find(bpy.data.materials, name)
    if existing is not None and MATERIAL in existing:
        return existing
    material = bpy.data.materials.new(name)
    material[MATERIAL] = True
    material.diffuse_color = (*mean.tolist(), 1)
    shader, settings = (
        node_trees.principled(material),
        {"attribute_name": captures.HAIR_COLOUR, "location": (-260, 280)},
    )
    colour = node_trees.add(material.node_tree, 'ShaderNodeAttribute', **settings).outputs["Color"]
    node_trees.feed(shader, {"Base Color": colour, "Roughness": ROUGHNESS, "IOR": IOR})
    return material


def _write(data, name: str, kind: str, domain: str, field: str, values: np.ndarray) -> None:
    attribute = data.attributes.get(name) or data.attributes.new(name, kind, domain)
    attribute.data.foreach_set(field, values.astype(np.float32).ravel())


def _offsets(data) -> np.ndarray:
    """Return where each curve's points begin, and the end, [M + 1]."""
    return read_field(data.curve_offset_data, "value", kind=np.int32)


def _read(attribute, field: str, width: int) -> np.ndarray:
    return read_field(attribute.data, field, width).astype(np.float64)


def _digest(data) -> str:
    """Hash the number of curves and points, their places, radii and colours."""
    content = _offsets(data).tobytes()
    for name, field, width in (("position", "vector", 3), ("radius", "value", 1), (captures.HAIR_COLOUR, "color", 4)):
        if name in data.attributes:
            content += read_field(data.attributes[name].data, field, width).tobytes()
    return hashlib.blake2b(content, digest_size=16).hexdigest()
