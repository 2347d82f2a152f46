# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of the artist's own materials on a head that is delivered."""

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from tests.wildcap_addon.deliver.test_deliver import capture, deliver, glb  # noqa: E402, F401  (capture is a fixture)


def test_pictures_of_the_artists_own_materials_take_no_maps_place(capture):  # noqa: F811
    """Two with one last word in their names, which is a map's, too; every picture is in the file as it was packed."""
    head = bpy.data.objects["face"]
    packed = set()
    for number, name in enumerate(("Ear Ring/Albedo", "Ring Albedo", "Stud Albedo")):
        material = bpy.data.materials.new(name)
        if material.node_tree is None:  # before Blender 5
            material.use_nodes = True
        node = material.node_tree.nodes.new('ShaderNodeTexImage')
        node.image = bpy.data.images.new(name, 4, 4)
        node.image.pixels.foreach_set((0.2, 0.3 * number, 0.5, 1.0) * 16)
        node.image.pack()
        packed.add(bytes(node.image.packed_file.data))
        shader = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        head.data.materials.append(material)
        head.data.polygons[number].material_index = len(head.data.materials) - 1
    maps = {name: (capture.maps / f"{name}.png").read_bytes() for name in ("diffuse_albedo", "normal")}
    folder = deliver(capture)
    assert (folder / "textures" / "face_albedo.png").read_bytes() == maps["diffuse_albedo"]
    document, binary = glb(folder / "face.glb")
    views = [document["bufferViews"][image["bufferView"]] for image in document["images"]]
    assert {binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views} == {*packed, *maps.values()}
