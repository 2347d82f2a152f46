# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves on a head: rooted in its UVs, so that they go along with its face units and can be combed with Blender's
own brushes.

One object for each part, a child of the head, marked by the custom property captures.HAIR_KEY. A digest tells whether
somebody combed them since.
"""

import hashlib

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.interpolate import poly_3d_calc

from .. import captures, colours, head, local_view, node_trees
from ..data_blocks import find, read_field, replace_data

TITLES = {"brows": "Brows", "lashes": "Lashes", "beard": "Beard"}
GROWN, MATERIAL = "wildcap_grown", "wildcap_hair_material"
ROOT = "wildcap_root"
"""Attribute of each curve: the place of the skin, in the head's axes, to which it is rooted."""
ROOTED_M = 0.01
"""Farther from its first point no place of the skin is a hair's root."""
UVS = "surface_uv_coordinate"
ROUGHNESS, IOR = 0.4, 1.55
"""Of keratin; hairs' scales spread its shine."""
INNER_TILE = 10
"""Where the UVs of what is no skin go."""
DEFORM = "WildCap Hair on Head"


def of(obj) -> list[bpy.types.Object]:
    """The hair of a head, by part."""
    hairs = {hair[captures.HAIR_KEY]: hair for hair in captures.hair(obj)}
    return [hairs[part] for part in TITLES if part in hairs]


def grow_part(context, obj, part: str, points: np.ndarray, radius: np.ndarray, colour: np.ndarray) -> bool:
    """Puts the hairs of a part on the head; those that somebody combed only follow the skin.

    Parameters
    ----------
    context : Blender's
    obj : the head
    part : a key of TITLES
    points : [M, K, 3], metres in the head's axes, from the root on
    radius : [M, K], metres
    colour : [M, 3], linear

    Returns
    -------
    False where the hairs stay as they were combed.
    """
    hair = next((child for child in of(obj) if child[captures.HAIR_KEY] == part), None)
    if hair is not None and is_combed(hair):
        follow(hair, obj)
        return False
    colour = colours.to_working(colour)
    data = _made(f"{obj.name} {TITLES[part]}", points, radius, colour)
    if hair is None:
        hair = bpy.data.objects.new(data.name, data)
        for collection in obj.users_collection:
            collection.objects.link(hair)
        hair.parent = obj
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
    """Whether somebody moved, cut, added, thickened or coloured hairs since they were grown."""
    return hair.get(GROWN) != _digest(hair.data)


def follow(hair, obj) -> None:
    """Moves each hair as the skin under its root moved, where the head has another shape than when they were rooted,
    and keeps what was combed. Hairs that a brush added since have no such place yet: they are rooted where they are."""
    data, combed = hair.data, is_combed(hair)
    if ROOT not in data.attributes or UVS not in data.attributes or not data.curves:
        return
    data.surface_uv_map = _rooting_uvs(obj.data)
    offsets, position = _offsets(data), _read(data.attributes["position"], "vector", 3)
    first = position[offsets[:-1]]
    uv, before = _read(data.attributes[UVS], "vector", 2), _read(data.attributes[ROOT], "vector", 3)
    known = np.linalg.norm(before - first, axis=1) < ROOTED_M
    places = before.copy()
    places[known] = _places(obj.data, uv[known], before[known])
    uv[~known], places[~known] = _nearest(obj.data, first[~known])
    moved = np.where(known[:, None], places - before, 0)
    if known.all() and np.abs(moved).max() < 1e-6:
        return
    position += np.repeat(moved, np.diff(offsets), 0)
    for name, vectors in (("position", position), (ROOT, places), (UVS, uv)):
        data.attributes[name].data.foreach_set("vector", vectors.astype(np.float32).ravel())
    data.update_tag()
    if not combed:
        hair[GROWN] = _digest(data)


def _made(name: str, points: np.ndarray, radius: np.ndarray, colour: np.ndarray) -> bpy.types.Curves:
    count, knots = points.shape[:2]
    data = bpy.data.hair_curves.new(name)
    data.add_curves([knots] * count)
    data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    _attribute(data, "radius", 'FLOAT', 'POINT').data.foreach_set("value", radius.astype(np.float32).ravel())
    rgba = np.concatenate([colour, np.ones((count, 1))], 1)
    _attribute(data, captures.HAIR_COLOUR, 'FLOAT_COLOR', 'CURVE').data.foreach_set(
        "color", rgba.astype(np.float32).ravel()
    )
    return data


def _root(hair, obj) -> None:
    """Binds each hair to the nearest place of the head's skin at rest, by its UVs."""
    data = hair.data
    roots = _read(data.attributes["position"], "vector", 3)[_offsets(data)[:-1]]
    uv, places = _nearest(obj.data, roots)
    _attribute(data, UVS, 'FLOAT2', 'CURVE').data.foreach_set("vector", uv.astype(np.float32).ravel())
    _attribute(data, ROOT, 'FLOAT_VECTOR', 'CURVE').data.foreach_set("vector", places.astype(np.float32).ravel())
    data.surface, data.surface_uv_map = obj, _rooting_uvs(obj.data)
    obj.add_rest_position_attribute = True  # what hair is bent against when the head moves
    if DEFORM not in hair.modifiers:
        modifier = hair.modifiers.new(DEFORM, 'NODES')
        modifier.node_group = _deform_group()


def _rooting_uvs(mesh) -> str:
    """The name of the UV map in which each place of the skin is the only one with its UVs, made where there is none."""
    if head.OUTER in mesh and head.HAIR_UVS not in mesh.uv_layers:
        active = mesh.uv_layers.active_index
        uv = read_field(mesh.uv_layers[0].data, "uv", 2)
        uv[mesh.polygons[mesh[head.OUTER]].loop_start :] += INNER_TILE
        mesh.uv_layers.new(name=head.HAIR_UVS, do_init=False).data.foreach_set("uv", uv.ravel())
        mesh.uv_layers.active_index = active
    return head.HAIR_UVS if head.OUTER in mesh else mesh.uv_layers[0].name


def _nearest(mesh, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """UVs [M, 2] and places [M, 3] of the skin nearest to roots [M, 3]; sockets, eyes and mouth are no skin."""
    corners, places, uvs = _skin(mesh)
    tree = BVHTree.FromPolygons(places.tolist(), corners.tolist())
    uv, nearest = np.zeros((len(roots), 2)), np.zeros((len(roots), 3))
    for k, root in enumerate(roots.tolist()):
        place, _, face, _ = tree.find_nearest(root)
        weights = np.array(poly_3d_calc([Vector(places[i]) for i in corners[face]], place))
        uv[k], nearest[k] = weights @ uvs[face], place
    return uv, nearest


def _places(mesh, uv: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Where the skin has UVs [M, 2], [M, 3]; `otherwise` [M, 3] where no triangle has them."""
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
    """Triangles [F, 3] of the head's own skin at rest, the places of all vertices [V, 3], and the triangles' UVs [F, 3,
    2]."""
    mesh.calc_loop_triangles()
    corners, loops, polygons = (
        read_field(mesh.loop_triangles, field, width, np.int32)
        for field, width in (("vertices", 3), ("loops", 3), ("polygon_index", 1))
    )
    places = read_field(mesh.shape_keys.reference_key.data if mesh.shape_keys else mesh.vertices, "co", 3)
    uvs = read_field(mesh.uv_layers[0].data, "uv", 2)
    skin = polygons < mesh.get(head.OUTER, len(mesh.polygons))
    return corners[skin], places.astype(np.float64), uvs[loops[skin]].astype(np.float64)


def _deform_group() -> bpy.types.NodeTree:
    """Curves go along with the surface that they are rooted in: made once per file."""
    group = find(bpy.data.node_groups, DEFORM)
    if group is None:
        group = bpy.data.node_groups.new(DEFORM, 'GeometryNodeTree')
        group.is_modifier = True
        for side in ('INPUT', 'OUTPUT'):
            group.interface.new_socket("Geometry", in_out=side, socket_type='NodeSocketGeometry')
        source, deform, target = (
            group.nodes.new(kind) for kind in ('NodeGroupInput', 'GeometryNodeDeformCurvesOnSurface', 'NodeGroupOutput')
        )
        deform.location, target.location = (200, 0), (420, 0)
        group.links.new(source.outputs[0], deform.inputs["Curves"])
        group.links.new(deform.outputs["Curves"], target.inputs[0])
    return group


def _material(name: str, mean: np.ndarray) -> bpy.types.Material:
    """Hair in its own colour, in Solid shading in their mean [3]; one of that name keeps the artist's changes.

    Opaque: what was measured is an albedo. Principled Hair's colour is that of a whole head of hair, and single hairs
    of it over light skin come out blond."""
    existing = find(bpy.data.materials, name)
    if existing is not None and MATERIAL in existing:
        return existing
    material = bpy.data.materials.new(name)
    material[MATERIAL] = True
    material.diffuse_color = (*mean.tolist(), 1)
    tree = node_trees.of(material)
    shader = next(node for node in tree.nodes if node.type == 'BSDF_PRINCIPLED')
    shader.inputs["Roughness"].default_value, shader.inputs["IOR"].default_value = ROUGHNESS, IOR
    colour = tree.nodes.new('ShaderNodeAttribute')
    colour.attribute_name, colour.location = captures.HAIR_COLOUR, (-260, 280)
    tree.links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    return material


def _attribute(data, name: str, kind: str, domain: str):
    return data.attributes.get(name) or data.attributes.new(name, kind, domain)


def _offsets(data) -> np.ndarray:
    """Where each curve's points begin, and the end, [M + 1]."""
    return read_field(data.curve_offset_data, "value", kind=np.int32)


def _read(attribute, field: str, width: int) -> np.ndarray:
    return read_field(attribute.data, field, width).astype(np.float64)


def _digest(data) -> str:
    """Stands for how many curves and points there are, where, how thick, and in which colours."""
    told = _offsets(data).tobytes()
    for name, field, width in (("position", "vector", 3), ("radius", "value", 1), (captures.HAIR_COLOUR, "color", 4)):
        if name in data.attributes:
            told += _read(data.attributes[name], field, width).astype(np.float32).tobytes()
    return hashlib.blake2b(told, digest_size=16).hexdigest()
