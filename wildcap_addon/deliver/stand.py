# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is exported: copies of the meshes in a scene of their own, in the delivery's unit, with plain materials that
refer to the delivered maps.

The artist's objects, materials and scene stay as they are; all of it is gone again when the export has ended.
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
"""What each format's exporter writes as it is. glTF's would make new pictures of roughness and specular."""
HAIR_IN = ".usdc"
"""The format that holds hair curves."""
NAMES_ITS_SPACE = (5, 2, 0)
"""The Blender from which on USD says in which space its colours are."""
LIDS = ("eyesOpenLeft", "eyesOpenRight")
DRIVEN = ("eyesHalfLeft", "eyesHalfRight")
SOCKETS = {"base_color": "Base Color", "roughness": "Roughness", "specular": "Specular IOR Level"}


@contextmanager
def standing(context, plan: DeliveryPlan, source: bpy.types.Object | Path) -> Iterator[bpy.types.Object]:
    """The copy to export, selected and active in a scene of its own; `source` is the object in the scene, or the mesh
    file. The packing in plan.staged says which maps there are."""
    packing = json.loads((plan.staged / PACKING).read_text(encoding="utf-8"))
    before = {
        name: set(getattr(bpy.data, name))
        for name in ("materials", "images", "meshes", "hair_curves", "objects", "scenes", "shape_keys")
    }
    window, shown, seen = context.window, context.window.scene, _looks(context)
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
        _at_rest(obj)
        mesh.transform(Matrix.Scale(FACTORS[plan.unit], 4), shape_keys=True)
        _materials(mesh, plan, packing)
        scene.collection.objects.link(obj)
        hairs = _hairs(plan, source, obj) if plan.what == "head" and plan.format.suffix == HAIR_IN else []
        for hair in hairs:
            scene.collection.objects.link(hair)
        window.scene = scene
        for thing in (obj, *hairs):
            thing.select_set(True, view_layer=scene.view_layers[0])
        scene.view_layers[0].objects.active = obj
        yield obj
    finally:
        window.scene = shown
        for name in ("scenes", "objects", "meshes", "hair_curves", "materials", "images"):
            kept = getattr(bpy.data, name)
            for thing in set(kept) - before[name]:
                kept.remove(thing)
        _look_again(context, *seen)


def left_behind(obj: bpy.types.Object | None, what: str, suffix: str) -> tuple[str, ...]:
    """What the head wears that a delivery leaves out, a sentence each."""
    if obj is None or what != "head":
        return ()
    hair = ("The hair stays here: of these formats only USD holds it.",)
    eyes = ("The close-up eyes and mouth stay here: the delivered head has its plain ones.",)
    return (hair if captures.hair(obj) and suffix != HAIR_IN else ()) + (eyes if captures.close_up(obj) else ())


def _looks(context) -> tuple[list, str, list[str]]:
    """What another scene in the window and an import change: of each 3D view the space, from where it looks and through
    which camera; the names of the active object and of those that are selected."""
    spaces = [area.spaces.active for area in context.window.screen.areas if area.type == 'VIEW_3D']
    views = [(space, space.region_3d.view_perspective, space.camera) for space in spaces]
    active = context.view_layer.objects.active
    return (
        views,
        active.name if active else "",
        [thing.name for thing in context.view_layer.objects if thing.select_get()],
    )


def _look_again(context, views: list, active: str, selected: list[str]) -> None:
    for space, perspective, camera in views:
        space.camera = camera
        space.region_3d.view_perspective = perspective
    layer = context.view_layer
    layer.update()  # which knows of what was removed only now
    for thing in layer.objects:
        thing.select_set(thing.name in selected)
    layer.objects.active = layer.objects.get(active)


def _hairs(plan: DeliveryPlan, source: bpy.types.Object, obj) -> list[bpy.types.Object]:
    """Copies of the head's hair at rest, children of the copy `obj`, in one plain colour each: USD's preview material
    reads no attribute."""
    copies = []
    for hair in captures.hair(source):
        copy = bpy.data.objects.new(f"{plan.name}_{hair[captures.HAIR_KEY]}", hair.data.copy())
        copy.data.name, copy.parent, copy.data.surface = copy.name, obj, None
        copy.data.materials.clear()
        material, shader = _new(copy.name)
        shader.inputs["Base Color"].default_value = _exported((*_mean_colour(copy.data), 1), plan)
        copy.data.materials.append(material)
        copies.append(copy)
    return copies


def _mean_colour(data: bpy.types.Curves) -> list[float]:
    """The mean of the hairs' colours, in the scene's working space; Blender's grey where they have none."""
    attribute = data.attributes.get(captures.HAIR_COLOUR)
    if attribute is None or not attribute.data:
        return [0.8] * 3
    return read_field(attribute.data, "color", 4)[:, :3].mean(0).tolist()


def require_eyes(plan: DeliveryPlan, obj: bpy.types.Object | None) -> None:
    """Raises Problem where the target wants open eyes and the head has lids that cannot open."""
    if plan.what == "head" and plan.preset.open_eyes and (obj is None or not _lids(obj.data)):
        raise Problem(
            f"{plan.preset.title} wants a head with open eyes, and this one's lids are closed.",
            "Click Add Face Units, under Face Units, and then Deliver again.",
        )


def _lids(mesh) -> list:
    """The shape keys that open the lids: those that the head's face units bring along."""
    return (
        [mesh.shape_keys.key_blocks[name] for name in LIDS if name in mesh.shape_keys.key_blocks]
        if mesh.shape_keys is not None
        else []
    )


def _open_eyes(obj) -> None:
    """The head of an object with its lids open for good, and without shape keys."""
    rest = read_field(obj.data.shape_keys.reference_key.data, "co", 3)
    opened = rest.copy()
    for key in _lids(obj.data):
        opened += read_field(key.data, "co", 3) - rest
    keys = obj.data.shape_keys
    obj.shape_key_clear()
    if keys in set(bpy.data.shape_keys):  # nobody's any more, and Blender keeps it until the file is read again
        bpy.data.batch_remove([keys])
    obj.data.vertices.foreach_set("co", opened.ravel())
    obj.data.update()


def _at_rest(obj) -> None:
    """Shape keys at zero: what is delivered is the neutral head, and the keys, but for those that only drivers move."""
    keys = obj.data.shape_keys
    if keys is not None:
        keys.animation_data_clear()
        for key in keys.key_blocks:
            key.value, key.mute = 0.0, False
        for key in filter(None, map(keys.key_blocks.get, DRIVEN)):
            obj.shape_key_remove(key)


def _materials(mesh, plan: DeliveryPlan, packing: dict) -> None:
    """The skin's slot becomes the delivered material, one per UV tile where there are several; other slots (eyes) plain
    ones of the same name and colour."""
    several, tiles = packing["several"], sorted({entry["tile"] for entry in packing["maps"]})
    slots, others = [polygon.material_index for polygon in mesh.polygons], list(mesh.materials)[1:]
    mesh.materials.clear()  # and every polygon is in the first slot
    for tile in tiles:
        maps = [entry for entry in packing["maps"] if entry["tile"] == tile]
        mesh.materials.append(
            _skin(plan.material(tile, several), plan, maps, packing["roughness"], mesh.uv_layers[0].name)
        )
    for other in others:
        mesh.materials.append(_plain(other, plan))
    layer = mesh.uv_layers[0].uv
    for polygon, slot in zip(mesh.polygons, slots, strict=True):
        if 0 < slot <= len(others):
            polygon.material_index = len(tiles) - 1 + slot
        elif several:
            middle = [sum(layer[i].vector[axis] for i in polygon.loop_indices) / polygon.loop_total for axis in (0, 1)]
            tile = HEAD_TILE + floor(middle[0]) + 10 * floor(middle[1])
            polygon.material_index = tiles.index(tile) if tile in tiles else 0


def _skin(name: str, plan: DeliveryPlan, maps: list[dict], roughness: float, uv_map: str) -> bpy.types.Material:
    material, shader = _new(name)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["IOR"].default_value = 1.4
    tree = material.node_tree
    for entry in maps:
        if entry["slot"] not in LINKED[plan.format.suffix]:
            continue
        node = tree.nodes.new('ShaderNodeTexImage')
        node.image = bpy.data.images.load(str(plan.staged / entry["file"]))
        if plan.what == "head":  # all of its skin is within the picture, whose borders are crown and neck
            node.extension = 'EXTEND'
        if entry["kind"] != "colour":
            colours.as_data(node.image)
        elif plan.colour == "srgb":
            colours.as_srgb(node.image)
        if entry["slot"] == "normal":
            bump = tree.nodes.new('ShaderNodeNormalMap')
            bump.uv_map = uv_map
            tree.links.new(node.outputs["Color"], bump.inputs["Color"])
            tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
        else:
            tree.links.new(node.outputs["Color"], shader.inputs[SOCKETS[entry["slot"]]])
    return material


def _plain(original, plan: DeliveryPlan) -> bpy.types.Material:
    """A plain material in another's place, with its name, its colour in the viewport and the picture of its colour, if
    that is packed (the eyes')."""
    material, shader = _new(f"{original.name} Delivered" if original is not None else "Plain")
    if original is None:
        return material
    shader.inputs["Base Color"].default_value = _exported(original.diffuse_color, plan)
    shader.inputs["Roughness"].default_value = original.roughness
    packed = _packed(original)
    if packed is not None:
        node = material.node_tree.nodes.new('ShaderNodeTexImage')
        node.image = bpy.data.images.load(str(_unpacked(packed, original, plan)))
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material


def _packed(original) -> bpy.types.Image | None:
    """The packed PNG before a material's Base Color."""
    for node in original.node_tree.nodes if original.node_tree is not None else ():
        socket = node.inputs.get("Base Color")
        image = getattr(socket.links[0].from_node, "image", None) if socket is not None and socket.is_linked else None
        if image is not None and image.packed_file is not None and image.packed_file.data[:4] == b"\x89PNG":
            return image
    return None


def _unpacked(image: bpy.types.Image, original, plan: DeliveryPlan) -> Path:
    """The file of a packed PNG among the delivery's own, named after the last word of its material's name, and no
    other's in its place."""
    last_word = delivery_plan.safe_name((original.name.split() or [""])[-1]).lower()
    path = plan.staged / delivery_plan.TEXTURES / f"{plan.name}_{last_word}.png"
    path.parent.mkdir(exist_ok=True)
    data = bytes(image.packed_file.data)
    if path.is_file() and path.read_bytes() != data:
        path = free_place(path)
    path.write_bytes(data)
    return path


def _exported(rgba: tuple, plan: DeliveryPlan) -> tuple[float, ...]:
    """A colour of the working space as the exporter is to write it, which passes its numbers on: a file's are linear
    light of sRGB's primaries, but for a USD that names the space that they are in."""
    named = plan.format.suffix == ".usdc" and bpy.app.version >= NAMES_ITS_SPACE
    return tuple(rgba) if named else (*colours.from_working(tuple(rgba)[:3]), rgba[3])


def _new(name: str):
    material = bpy.data.materials.new(name)
    return material, next(node for node in node_trees.of(material).nodes if node.type == 'BSDF_PRINCIPLED')
