# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of the meshes for export, in a scene of their own, in the delivery's unit, with plain materials of its maps.

The artist's objects, materials and scene stay as they are; the copies are gone when the export has ended.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from math import floor
from pathlib import Path

import bpy
from mathutils import Matrix

from ...core.capture import delivery_plan
from ...core.capture.delivery_plan import PACKING, DeliveryPlan
from ...core.capture.messages import Problem
from ...core.capture.ownership import free_place
from .. import captures, colours, head, node_trees
from ..data_blocks import read_field
from ..node_trees import add, feed

SCENE = "WildCap Delivery"
HEAD_TILE = 1001
FACTORS = {"m": 1.0, "cm": 100.0}
LINKED = {
    ".glb": ("base_color", "normal"),
    ".gltf": ("base_color", "normal"),
    ".usdc": ("base_color", "normal", "roughness"),
    ".fbx": ("base_color", "normal", "roughness", "specular"),
    ".obj": ("base_color", "normal", "roughness", "specular"),
}
"""Maps that each format's exporter writes unchanged. glTF's would make new pictures of roughness and specular."""
HAIR_IN = ".usdc"
"""Format that holds hair curves."""
NAMES_ITS_SPACE = (5, 2, 0)
"""First Blender whose USD names the space of its colours."""
LIDS = ("eyesOpenLeft", "eyesOpenRight")
DRIVEN = ("eyesHalfLeft", "eyesHalfRight")
SOCKETS = {"base_color": "Base Color", "roughness": "Roughness", "specular": "Specular IOR Level"}


@contextmanager
def standing(context, plan: DeliveryPlan, source: bpy.types.Object | Path) -> Iterator[None]:
    """Show the copy of an object or mesh file, selected and active in a scene of its own.

    The packing in plan.staged lists the maps.
    """
    packing = json.loads((plan.staged / PACKING).read_text(encoding="utf-8"))
    kinds = ("scenes", "objects", "meshes", "hair_curves", "materials", "images")
    before = {kind: set(getattr(bpy.data, kind)) for kind in kinds}
    window, own_scene, view = context.window, context.window.scene, _save_view(context)
    try:
        scene = bpy.data.scenes.new(SCENE)
        scene.unit_settings.scale_length = 1 / FACTORS[plan.unit]
        mesh = source.data.copy() if isinstance(source, bpy.types.Object) else head.read_mesh_file(context, source)
        obj = bpy.data.objects.new(plan.name, mesh)
        mesh.name = plan.name
        if head.HAIR_UVS in mesh.uv_layers:
            mesh.uv_layers.remove(mesh.uv_layers[head.HAIR_UVS])
        if plan.what == "head" and plan.preset.open_eyes:
            _open_eyes(obj)
        _rest(obj)
        mesh.transform(Matrix.Scale(FACTORS[plan.unit], 4), shape_keys=True)
        _materials(mesh, plan, packing)
        hairs = _hairs(plan, source, obj) if plan.what == "head" and plan.format.suffix == HAIR_IN else []
        for thing in (obj, *hairs):
            scene.collection.objects.link(thing)
        window.scene = scene
        for thing in (obj, *hairs):
            thing.select_set(True, view_layer=scene.view_layers[0])
        scene.view_layers[0].objects.active = obj
        yield
    finally:
        window.scene = own_scene
        for kind in kinds:
            blocks = getattr(bpy.data, kind)
            for thing in set(blocks) - before[kind]:
                blocks.remove(thing)
        _restore_view(context, *view)


def left_behind(obj: bpy.types.Object | None, what: str, suffix: str) -> tuple[str, ...]:
    """Return a sentence for each thing that the head wears and a delivery leaves out."""
    sentences = []
    if obj is not None and what == "head":
        if captures.hair(obj) and suffix != HAIR_IN:
            sentences.append("The hair stays here: of these formats only USD holds it.")
        if captures.close_up(obj):
            sentences.append("The close-up eyes and mouth stay here: the delivered head has its plain ones.")
    return tuple(sentences)


def _save_view(context) -> tuple[list, str, list[str]]:
    """Return what an export changes: the 3D views' perspective and camera, names of active and selected objects."""
    spaces = [area.spaces.active for area in context.window.screen.areas if area.type == 'VIEW_3D']
    views = [(space, space.region_3d.view_perspective, space.camera) for space in spaces]
    layer = context.view_layer
    active = layer.objects.active.name if layer.objects.active else ""
    return views, active, [thing.name for thing in layer.objects if thing.select_get()]


def _restore_view(context, views: list, active: str, selected: list[str]) -> None:
    for space, perspective, camera in views:
        space.camera = camera
        space.region_3d.view_perspective = perspective
    layer = context.view_layer
    layer.update()  # or it would still list what was removed
    for thing in layer.objects:
        thing.select_set(thing.name in selected)
    layer.objects.active = layer.objects.get(active)


def _hairs(plan: DeliveryPlan, source: bpy.types.Object, obj) -> list[bpy.types.Object]:
    """Return copies of the head's hair at rest, children of the copy `obj`.

    In one plain colour each: USD's preview material reads no attribute.
    """
    copies = []
    for hair in captures.hair(source):
        copy = bpy.data.objects.new(f"{plan.name}_{hair[captures.HAIR_KEY]}", hair.data.copy())
        copy.data.name, copy.parent, copy.data.surface = copy.name, obj, None
        copy.data.materials.clear()
        material, shader = _new(copy.name)
        feed(shader, {"Base Color": _exported((*_mean_colour(copy.data), 1), plan)})
        copy.data.materials.append(material)
        copies.append(copy)
    return copies


def _mean_colour(data: bpy.types.Curves) -> list[float]:
    """Return the mean of the hairs' colours in the scene's working space, Blender's grey if they have none."""
    attribute = data.attributes.get(captures.HAIR_COLOUR)
    if attribute is None or not attribute.data:
        return [0.8] * 3
    return read_field(attribute.data, "color", 4)[:, :3].mean(0).tolist()


def require_eyes(plan: DeliveryPlan, obj: bpy.types.Object | None) -> None:
    """Raise Problem if the target needs open eyes and the head has lids that cannot open."""
    if plan.what == "head" and plan.preset.open_eyes and (obj is None or not _lids(obj.data)):
        raise Problem(
            f"{plan.preset.title} needs a head with open eyes, and this one's lids are closed.",
            "Click Add Face Units, under Face Units, and then Deliver again.",
        )


def _lids(mesh) -> list:
    """Return the shape keys of the face units that open the lids."""
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys is not None else {}
    return [keys[name] for name in LIDS if name in keys]


def _open_eyes(obj) -> None:
    """Open the lids of a head for good and remove its shape keys."""
    keys = obj.data.shape_keys
    rest = read_field(keys.reference_key.data, "co", 3)
    opened = rest.copy()
    for key in _lids(obj.data):
        opened += read_field(key.data, "co", 3) - rest
    obj.shape_key_clear()
    if keys in set(bpy.data.shape_keys):  # without users, Blender keeps it until the file is read again
        bpy.data.batch_remove([keys])
    obj.data.vertices.foreach_set("co", opened.ravel())
    obj.data.update()


def _rest(obj) -> None:
    """Set all shape keys to zero, for the neutral head, and remove those that only drivers move."""
    keys = obj.data.shape_keys
    if keys is not None:
        keys.animation_data_clear()
        for key in keys.key_blocks:
            key.value, key.mute = 0.0, False
        for key in filter(None, map(keys.key_blocks.get, DRIVEN)):
            obj.shape_key_remove(key)


def _materials(mesh, plan: DeliveryPlan, packing: dict) -> None:
    """Replace the skin's material by the delivered one, per UV tile if there are several, and others by plain ones."""
    several, tiles = packing["several"], sorted({entry["tile"] for entry in packing["maps"]})
    slots, others = [polygon.material_index for polygon in mesh.polygons], list(mesh.materials)[1:]
    mesh.materials.clear()  # which puts every polygon in the first slot
    for tile in tiles:
        maps = [entry for entry in packing["maps"] if entry["tile"] == tile]
        name, uv_map = plan.material(tile, several), mesh.uv_layers[0].name
        mesh.materials.append(_skin(name, plan, maps, packing["roughness"], uv_map))
    for other in others:
        mesh.materials.append(_plain(other, plan))
    layer = mesh.uv_layers[0].uv
    for polygon, slot in zip(mesh.polygons, slots, strict=True):
        if 0 < slot <= len(others):
            polygon.material_index = len(tiles) - 1 + slot
        elif several:
            u, v = (sum(layer[i].vector[axis] for i in polygon.loop_indices) / polygon.loop_total for axis in (0, 1))
            tile = HEAD_TILE + floor(u) + 10 * floor(v)
            polygon.material_index = tiles.index(tile) if tile in tiles else 0


def _skin(name: str, plan: DeliveryPlan, maps: list[dict], roughness: float, uv_map: str) -> bpy.types.Material:
    material, shader = _new(name)
    feed(shader, {"Roughness": roughness, "IOR": 1.4})
    for entry in maps:
        if entry["slot"] not in LINKED[plan.format.suffix]:
            continue
        node = _picture_node(material, plan.staged / entry["file"])
        if plan.what == "head":  # its skin is within the picture, whose borders are crown and neck
            node.extension = 'EXTEND'
        if entry["kind"] != "colour":
            colours.as_data(node.image)
        elif plan.colour == "srgb":
            colours.as_srgb(node.image)
        if entry["slot"] == "normal":
            normal = add(material.node_tree, 'ShaderNodeNormalMap', {"Color": node.outputs["Color"]}, uv_map=uv_map)
            feed(shader, {"Normal": normal.outputs["Normal"]})
        else:
            feed(shader, {SOCKETS[entry["slot"]]: node.outputs["Color"]})
    return material


def _plain(original, plan: DeliveryPlan) -> bpy.types.Material:
    """Return a plain material with the name, viewport colour and packed picture (the eyes') of another."""
    material, shader = _new(f"{original.name} Delivered" if original is not None else "Plain")
    if original is None:
        return material
    feed(shader, {"Base Color": _exported(original.diffuse_color, plan), "Roughness": original.roughness})
    packed = _packed(original)
    if packed is not None:
        feed(shader, {"Base Color": _picture_node(material, _unpacked(packed, original, plan)).outputs["Color"]})
    return material


def _picture_node(material, path: Path) -> bpy.types.Node:
    return add(material.node_tree, 'ShaderNodeTexImage', image=bpy.data.images.load(str(path)))


def _packed(original) -> bpy.types.Image | None:
    """Return the packed PNG linked to a material's Base Color."""
    for node in original.node_tree.nodes if original.node_tree is not None else ():
        socket = node.inputs.get("Base Color")
        image = getattr(socket.links[0].from_node, "image", None) if socket is not None and socket.is_linked else None
        if image is not None and image.packed_file is not None and image.packed_file.data[:4] == b"\x89PNG":
            return image
    return None


def _unpacked(image: bpy.types.Image, original, plan: DeliveryPlan) -> Path:
    """Write a packed PNG among the delivery's textures, under the last word of its material's name, replacing none."""
    last_word = delivery_plan.safe_name((original.name.split() or [""])[-1]).lower()
    path = plan.staged / delivery_plan.TEXTURES / f"{plan.name}_{last_word}.png"
    path.parent.mkdir(exist_ok=True)
    data = bytes(image.packed_file.data)
    if path.is_file() and path.read_bytes() != data:
        path = free_place(path)
    path.write_bytes(data)
    return path


def _exported(rgba: tuple, plan: DeliveryPlan) -> tuple[float, ...]:
    """Convert a colour of the working space to the file's, as exporters write numbers unchanged.

    A file's colours are linear light of sRGB's primaries, except in a USD that names its space.
    """
    named = plan.format.suffix == ".usdc" and bpy.app.version >= NAMES_ITS_SPACE
    return tuple(rgba) if named else (*colours.from_working(tuple(rgba)[:3]), rgba[3])


def _new(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Return a new material and its shader."""
    material = bpy.data.materials.new(name)
    return material, node_trees.principled(material)
