# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Head object of a capture: head.obj in the scene with its UVs and its texture, updated in place."""

import contextlib
from pathlib import Path

import bpy
import numpy as np

from ..core.capture.capture import Capture
from ..core.capture.messages import Problem
from ..core.settings.colour_values import Colour, to_linear
from . import captures, colours, data_blocks, node_trees, toned_picture, tones

PREVIEW = "WildCap Preview"
"""Name of the image node that shows a running solve on the head."""

OUTER = "wildcap_outer_polygons"
"""Custom property of a mesh that has more than the head's skin: the number of the skin's polygons, which come first."""
HAIR_UVS = "WildCap Hair"
"""UV map of such a mesh with the skin alone, for the roots of hair: sockets continue the lids' maps."""

TEXTURE = "Texture"
"""Name of the image node that shows the texture until then."""
TEXTURE_KEY = "wildcap_texture"
"""Custom property of a material that shows the texture until the skin is assembled: its fingerprint as it was made."""

FOLLOWERS = []
"""Functions (head object, new mesh) -> bool of rooms that extend a head's mesh; True if that took the new shape, and
the new mesh is not needed."""

COMPLETERS = []
"""Functions (head object, capture) -> str of rooms that add to a head whose skin is assembled, such as the filmed eyes;
they return a message for the artist, or ''."""


def complete(obj, capture: Capture) -> str:
    """Run all completers, and return their messages."""
    return " ".join(filter(None, [add(obj, capture) for add in COMPLETERS]))


def wear_tone(obj: bpy.types.Object, capture: Capture, chosen: Colour | None) -> None:
    """Show the texture of a head that has no maps yet in a skin tone: its skin times one gain; None as it is.

    The texture's own brightness and hue are its light's as well as the skin's, so that is a preview of the tone alone.
    """
    material = obj.data.materials[0] if obj.data.materials else None
    nodes = material.node_tree.nodes if material is not None and material.node_tree is not None else {}
    if material is None or TEXTURE_KEY not in material or TEXTURE not in nodes or "wildcap_skin" in material:
        return
    texture = nodes[TEXTURE]
    with node_trees.keeping_fingerprint(material, TEXTURE_KEY, PREVIEW):
        node = texture
        if chosen is not None and capture.texture_png.is_file():
            gain = np.array(to_linear(chosen)) / toned_picture.mean_of_skin(capture.texture_png)
            with contextlib.suppress(Problem, OSError):  # a read-only capture
                picture = toned_picture.write(capture, capture.texture_png, gain)
                node = toned_picture.put(material, picture, (-320, 580))
        for link in list(material.node_tree.links):
            if link.from_node.name in (TEXTURE, toned_picture.NODE):
                material.node_tree.links.new(node.outputs["Color"], link.to_socket)
        if node == texture:
            toned_picture.remove(material)
            nodes.active = texture


def bring_in(context, item) -> bpy.types.Object:
    """Return the capture's head in the scene, active and selected.

    An existing head keeps its place and materials and gets the new mesh.
    """
    capture = captures.folder(item)
    if not capture.head.is_file():
        raise Problem("This capture has no head yet.", "Click Reconstruct first.")
    head = captures.head(context, item)
    if head is not None:
        captures.require_shown(context, head)
    mesh = read_mesh_file(context, capture.head)
    if head is None:
        head = bpy.data.objects.new(item.name, mesh)
        context.collection.objects.link(head)
        item.head = head
    else:
        mesh = _replace_mesh(head, mesh)
    mesh.name = item.name
    head[captures.HEAD_KEY] = item.path
    head["wildcap_head_time"] = capture.head.stat().st_mtime
    _show_texture(head, capture)
    tones.show_on(head, capture)
    context.view_layer.update()  # it does not yet know the objects linked and removed above
    for other in list(context.view_layer.objects):
        other.select_set(other == head)
    context.view_layer.objects.active = head
    return head


def _replace_mesh(head, mesh) -> bpy.types.Mesh:
    """Return the mesh of an existing head: the new one with the old materials, or its own in the new shape."""
    try:
        followed = any(follow(head, mesh) for follow in FOLLOWERS)
    except Problem:
        bpy.data.meshes.remove(mesh)
        raise
    if followed or _take_shape(head.data, mesh):
        bpy.data.meshes.remove(mesh)
        return head.data
    data_blocks.replace_data(head, mesh, bpy.data.meshes)
    return mesh


def _take_shape(kept_mesh: bpy.types.Mesh, new_mesh: bpy.types.Mesh) -> bool:
    """Give a mesh the coordinates of another one, and return whether their topology is the same.

    The artist's weights, UV maps, attributes and shape keys are kept.
    """
    corners = [data_blocks.read_field(mesh.loops, "vertex_index", kind=np.int32) for mesh in (kept_mesh, new_mesh)]
    if (
        len(kept_mesh.vertices) != len(new_mesh.vertices)
        or not np.array_equal(*corners)
        or kept_mesh.has_custom_normals
    ):
        return False
    places = data_blocks.read_field(new_mesh.vertices, "co", 3)
    keys = kept_mesh.shape_keys.key_blocks if kept_mesh.shape_keys else ()
    displacements = places - data_blocks.read_field(keys[0].data if keys else kept_mesh.vertices, "co", 3)
    for key in keys:
        key.data.foreach_set("co", (data_blocks.read_field(key.data, "co", 3) + displacements).ravel())
    kept_mesh.vertices.foreach_set("co", places.ravel())
    kept_mesh.update()
    return True


def look_at(context, head: bpy.types.Object) -> None:
    """Turn the window's 3D views to the face, in Local View: a start-up cube would swallow a head of real size."""
    if bpy.app.background or context.window is None:
        return
    for area in context.window.screen.areas:
        if area.type == 'VIEW_3D':
            region = next(r for r in area.regions if r.type == 'WINDOW')
            with context.temp_override(area=area, region=region, selected_objects=[head]):
                bpy.ops.view3d.view_axis(type='FRONT')
                if area.spaces.active.local_view is None and len(context.view_layer.objects) > 1:
                    bpy.ops.view3d.localview(frame_selected=True)
                else:
                    bpy.ops.view3d.view_selected()
            area.spaces.active.shading.color_type = 'TEXTURE'


def read_mesh_file(context, path: Path) -> bpy.types.Mesh:
    """Return an OBJ of a capture as mesh data: metres, +Z up, its one UV map named UVMap, smooth."""
    before = set(context.scene.objects)
    bpy.ops.wm.obj_import(
        filepath=str(path), forward_axis='Y', up_axis='Z', import_vertex_groups=False, validate_meshes=False
    )
    new = [o for o in context.scene.objects if o not in before]
    if len(new) != 1 or new[0].type != 'MESH' or not new[0].data.uv_layers:
        for o in new:
            bpy.data.objects.remove(o)
        raise Problem(f"{path.name} is not one mesh with UVs.", "Reconstruct again, or restore the file.")
    mesh = new[0].data
    bpy.data.objects.remove(new[0])
    for material in list(mesh.materials):
        mesh.materials.clear()
        if material is not None and material.users == 0:
            bpy.data.materials.remove(material)
    mesh.uv_layers[0].name = "UVMap"
    mesh.shade_smooth()
    return mesh


def load_image(path, data: bool = False) -> bpy.types.Image:
    """Return the image of a file as it is now, reloaded if Blender has it already: a picture in sRGB, or data.

    An image of that file that was painted on, or is packed in the .blend with other content, is left alone and kept.
    """
    path = Path(path)
    images = [image for image in bpy.data.images if image.source == 'FILE' and image.filepath]
    of_file = [i for i in images if Path(bpy.path.abspath(i.filepath, library=i.library)) == path]
    altered = [i for i in of_file if i.is_dirty or i.packed_file is not None and not _is_packed(i, path)]
    for image in altered:
        image.use_fake_user = True
    image = next((i for i in of_file if i not in altered and i.library is None), None)
    if image is None:
        image = bpy.data.images.load(str(path))
    if image.packed_file is None:
        image.reload()
    (colours.as_data if data else colours.as_srgb)(image)
    return image


def _is_packed(image: bpy.types.Image, path: Path) -> bool:
    """Return whether the .blend holds exactly this file, as when Blender packs resources automatically."""
    packed = image.packed_file
    return packed.size == path.stat().st_size and bytes(packed.data) == path.read_bytes()


def _show_texture(head, capture: Capture) -> None:
    """Give a head without a material one that shows the texture, until Assemble Material builds the skin there."""
    if not capture.texture_png.is_file():
        return
    image = load_image(capture.texture_png)
    if head.data.materials and head.data.materials[0] is not None:
        return
    material = bpy.data.materials.new(f"{head.name} Skin")
    tree = node_trees.of(material)
    nodes, links = tree.nodes, tree.links
    node = nodes.new('ShaderNodeTexImage')
    node.name = node.label = TEXTURE
    node.location = (-320, 280)
    node.image = image
    shader = next(n for n in nodes if n.type == 'BSDF_PRINCIPLED')
    links.new(node.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.6
    nodes.active = node
    material[TEXTURE_KEY] = node_trees.fingerprint(material, PREVIEW)
    if head.data.materials:
        head.data.materials[0] = material  # an empty slot
    else:
        head.data.materials.append(material)


def register():
    tones.viewers.append(wear_tone)


def unregister():
    tones.viewers.remove(wear_tone)
