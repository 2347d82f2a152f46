# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""WildCap Skin through time: the same tree in all Blenders, files of an older version, a folder that moved, an asset
library."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from tests.fixtures import node_text  # noqa: E402
from tests.fixtures.flat_patch import assembled, height_map, sockets  # noqa: E402

EXPECTED = """
ShaderNodeAttribute WildCap Regions: attribute_name=wildcap_roughness
ShaderNodeGroup WildCap Skin: Specular Amount=1.25, Roughness=0.45, IOR=1.4, Subsurface=1, Subsurface Scale=0.003, Displacement=0, Midlevel=0, Oil=0, Tone=1 1 1 1, Skin=1
ShaderNodeNormalMap WildCap Normal Map: uv_map=UVMap
ShaderNodeOutputMaterial Material Output
ShaderNodeTexImage WildCap Albedo: diffuse_albedo.png sRGB, interpolation=Cubic, extension=EXTEND
ShaderNodeTexImage WildCap Displacement: displacement.exr Non-Color, interpolation=Cubic, extension=EXTEND
ShaderNodeTexImage WildCap Normal: normal.png Non-Color, interpolation=Cubic, extension=EXTEND
ShaderNodeTexImage WildCap Specular: specular_albedo.png Non-Color, interpolation=Cubic, extension=EXTEND
ShaderNodeUVMap WildCap UV: uv_map=UVMap
WildCap Albedo.Color -> WildCap Skin.Albedo
WildCap Displacement.Color -> WildCap Skin.Height
WildCap Normal Map.Normal -> WildCap Skin.Normal
WildCap Normal.Color -> WildCap Normal Map.Color
WildCap Regions.Fac -> WildCap Skin.Region
WildCap Skin / NodeGroupInput WildCap Input
WildCap Skin / NodeGroupOutput WildCap Output
WildCap Skin / ShaderNodeBsdfPrincipled WildCap Principled: subsurface_method=RANDOM_WALK_SKIN, Subsurface Radius=1 0.37 0.19, Coat Roughness=0.3, Coat IOR=1.47
WildCap Skin / ShaderNodeDisplacement WildCap Displacement
WildCap Skin / ShaderNodeMath WildCap Coat: operation=MULTIPLY
WildCap Skin / ShaderNodeMath WildCap Oily: operation=MULTIPLY, use_clamp=True, Value=-6.25
WildCap Skin / ShaderNodeMath WildCap Regions: operation=MULTIPLY_ADD, use_clamp=True
WildCap Skin / ShaderNodeMath WildCap Specular Level: operation=MULTIPLY, use_clamp=True
WildCap Skin / ShaderNodeMix WildCap Given Back: B=1.048 1.073 1.078 1
WildCap Skin / ShaderNodeMix WildCap Tone
WildCap Skin / WildCap Coat.Value -> WildCap Principled.Coat Weight
WildCap Skin / WildCap Displacement.Displacement -> WildCap Output.Displacement
WildCap Skin / WildCap Given Back.Result -> WildCap Principled.Base Color
WildCap Skin / WildCap Input.Albedo -> WildCap Tone.A
WildCap Skin / WildCap Input.Displacement -> WildCap Displacement.Scale
WildCap Skin / WildCap Input.Height -> WildCap Displacement.Height
WildCap Skin / WildCap Input.IOR -> WildCap Principled.IOR
WildCap Skin / WildCap Input.Midlevel -> WildCap Displacement.Midlevel
WildCap Skin / WildCap Input.Normal -> WildCap Principled.Normal
WildCap Skin / WildCap Input.Oil -> WildCap Coat.Value
WildCap Skin / WildCap Input.Region -> WildCap Oily.Value
WildCap Skin / WildCap Input.Region -> WildCap Regions.Value
WildCap Skin / WildCap Input.Roughness -> WildCap Regions.Value
WildCap Skin / WildCap Input.Roughness -> WildCap Regions.Value
WildCap Skin / WildCap Input.Skin -> WildCap Tone.Fac
WildCap Skin / WildCap Input.Specular -> WildCap Specular Level.Value
WildCap Skin / WildCap Input.Specular Amount -> WildCap Specular Level.Value
WildCap Skin / WildCap Input.Subsurface -> WildCap Given Back.Fac
WildCap Skin / WildCap Input.Subsurface -> WildCap Principled.Subsurface Weight
WildCap Skin / WildCap Input.Subsurface Scale -> WildCap Principled.Subsurface Scale
WildCap Skin / WildCap Input.Tone -> WildCap Tone.B
WildCap Skin / WildCap Oily.Value -> WildCap Coat.Value
WildCap Skin / WildCap Principled.BSDF -> WildCap Output.BSDF
WildCap Skin / WildCap Regions.Value -> WildCap Principled.Roughness
WildCap Skin / WildCap Specular Level.Value -> WildCap Principled.Specular IOR Level
WildCap Skin / WildCap Tone.Result -> WildCap Given Back.A
WildCap Skin.BSDF -> Material Output.Surface
WildCap Skin.Displacement -> Material Output.Displacement
WildCap Specular.Color -> WildCap Skin.Specular
WildCap UV.UV -> WildCap Albedo.Vector
WildCap UV.UV -> WildCap Displacement.Vector
WildCap UV.UV -> WildCap Normal.Vector
WildCap UV.UV -> WildCap Specular.Vector
"""


def test_the_material_as_text(patch):
    """The same in all Blenders."""
    height_map(patch, 0.1)
    found = "\n".join(node_text.lines(assembled().node_tree))
    assert found == EXPECTED.strip(), found


def test_a_group_that_is_linked_from_a_library_stays_as_it_is_and_the_head_has_its_own(patch, tmp_path):
    group = bpy.data.node_groups.new("WildCap Skin", 'ShaderNodeTree')
    group["wildcap_version"] = 1
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {group}, fake_user=True)
    bpy.data.node_groups.remove(group)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.node_groups = ["WildCap Skin"]
    linked = wanted.node_groups[0]
    linked.use_fake_user = True
    bpy.ops.wildcap.bring_in_head()
    own = sockets(assembled())[0].node.node_tree
    assert linked.library is not None and linked["wildcap_version"] == 1 and not linked.interface.items_tree
    assert own != linked and own.library is None and own["wildcap_version"] > 1


def test_a_group_of_an_older_version_is_rebuilt_inside_and_keeps_what_the_artist_did(patch, addon):
    """A group that lacks one of our nodes, with an artist's roughness, a clear coat inside, and nodes of their own."""
    material = assembled()
    skin, note = material.node_tree.nodes["WildCap Skin"], material.node_tree.nodes.new('NodeReroute')
    group, lacking = skin.node_tree, "WildCap Displacement"
    group.nodes.remove(group.nodes[lacking])
    principled, inside = group.nodes["WildCap Principled"], group.nodes.new('ShaderNodeHueSaturation')
    group.links.new(group.nodes["WildCap Input"].outputs["Albedo"], inside.inputs["Color"])
    group.links.new(inside.outputs["Color"], principled.inputs["Base Color"])
    group.links.remove(principled.inputs["Coat Weight"].links[0])
    principled.inputs["Coat Weight"].default_value = 0.2
    skin.inputs["Roughness"].default_value, skin.inputs["Subsurface Scale"].default_value = 0.31, 0.01
    version = group["wildcap_version"]
    group["wildcap_version"] = version - 1
    assert assembled() == material and sockets(material) == skin.inputs and skin.node_tree == group
    assert group["wildcap_version"] == version and lacking in group.nodes
    values = [skin.inputs[name].default_value for name in ("Specular Amount", "Roughness", "Subsurface Scale")]
    assert values == pytest.approx([1.25, 0.31, 0.01])
    assert note.name in material.node_tree.nodes
    assert principled.inputs["Base Color"].links[0].from_node == inside
    assert principled.inputs["Coat Weight"].default_value == pytest.approx(0.2)
    expected = {
        line.split("WildCap Skin / ", 1)[1] for line in EXPECTED.splitlines() if line.startswith("WildCap Skin / ")
    }
    assert {line for line in expected - set(node_text.lines(group)) if "ShaderNodeBsdfPrincipled" not in line} == {
        "WildCap Given Back.Result -> WildCap Principled.Base Color",
        "WildCap Coat.Value -> WildCap Principled.Coat Weight",
    }


def test_the_group_is_an_asset_with_a_preview_and_a_catalogue(patch, addon, tmp_path):
    asset = addon("relight.asset")
    library = bpy.context.preferences.filepaths.asset_libraries.new(name="Mine", directory=str(tmp_path))
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
        for _ in range(2):
            assembled()
        group = bpy.data.node_groups["WildCap Skin"]
        assert group.asset_data.catalog_id == asset.CATALOGUE and "skin" in group.asset_data.tags
        pixels = np.array(group.preview.image_pixels_float).reshape(*group.preview.image_size, 4)
        middle = pixels[asset.SIDE_PX // 2, asset.SIDE_PX // 2]
        assert middle[3] == pytest.approx(1) and 1 > middle[0] > middle[1] > middle[2] > 0.2 and pixels[0, 0, 3] == 0
        assert (tmp_path / asset.FILE).read_text(encoding="utf-8").splitlines().count(asset.LINE) == 1
        group.asset_clear()
        assembled()
        assert group.asset_data is None, "who takes it out of the assets is not overruled"
    finally:
        bpy.context.preferences.filepaths.asset_libraries.remove(library)
