# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble Material and Render in the bpy wheel: node trees compared as text, pictures by their brightness."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def test_the_material_is_wired_with_its_colour_spaces(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    material = bpy.context.view_layer.objects.active.data.materials[0]
    lines = addon("relight.material").as_text(material.node_tree)
    for line in (
        "ShaderNodeTexImage WildCap Albedo: diffuse_albedo.png sRGB",
        "ShaderNodeTexImage WildCap Specular: specular_albedo.png Non-Color",
        "ShaderNodeTexImage WildCap Normal: normal.png Non-Color",
        "WildCap Albedo.Color -> WildCap Skin.Albedo",
        "WildCap Specular.Color -> WildCap Skin.Specular",
        "WildCap Normal.Color -> WildCap Normal Map.Color",
        "WildCap Normal Map.Normal -> WildCap Skin.Normal",
        "WildCap Skin.BSDF -> Material Output.Surface",
        "WildCap UV.UV -> WildCap Albedo.Vector",
        "WildCap Skin / Group Input.Albedo -> Principled BSDF.Base Color",
        "WildCap Skin / Group Input.Normal -> Principled BSDF.Normal",
        "WildCap Skin / Math.Value -> Principled BSDF.Specular IOR Level",
    ):
        assert line in lines, "\n".join(lines)
    assert any(line.startswith("ShaderNodeNormalMap WildCap Normal Map: UVMap") for line in lines)
    assert any("IOR=1.4" in line and "Subsurface Scale=0.0037" in line for line in lines if line.startswith("ShaderNodeGroup WildCap Skin"))


def test_assembling_again_keeps_the_artists_values_and_makes_nothing_new(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    material = bpy.context.view_layer.objects.active.data.materials[0]
    material.node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value = 0.3
    before = addon("relight.material").as_text(material.node_tree), len(bpy.data.images), len(bpy.data.materials), len(bpy.data.node_groups)
    bpy.ops.wildcap.assemble_material()
    assert (addon("relight.material").as_text(material.node_tree), len(bpy.data.images), len(bpy.data.materials), len(bpy.data.node_groups)) == before
    assert material.node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value == pytest.approx(0.3)


def test_somebody_elses_material_is_replaced_but_not_changed(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    other = bpy.data.materials.new("Mine")
    other.use_nodes = True
    head.data.materials[0] = other
    bpy.ops.wildcap.assemble_material()
    assert head.data.materials[0] != other
    assert len(other.node_tree.nodes) == 2


def test_scattering_follows_the_heads_size(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    head.scale = (10, 10, 10)
    bpy.context.view_layer.update()
    bpy.ops.wildcap.assemble_material()
    assert head.data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Subsurface Scale"].default_value == pytest.approx(0.037)


def test_a_render_is_written_and_the_scene_is_untouched(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    scene = bpy.context.scene
    before = scene.camera, scene.world, scene.render.engine, scene.render.filepath, {o.name for o in scene.objects}
    props = scene.wildcap
    props.resolution, props.samples = 64, 4
    means = []
    for light in ("studio", "sun", "window"):
        props.light = light
        bpy.ops.wildcap.render()
        image = bpy.data.images.load(str(capture / "renders" / f"{light}.png"))
        pixels = np.array(image.pixels[:]).reshape(64, 64, 4)
        means.append(pixels[24:40, 24:40, :3].mean())
    assert all(0.1 < mean < 0.95 for mean in means), means
    assert [p.name for p in (capture / "renders").iterdir() if p.name.startswith(".")] == []
    assert (scene.camera, scene.world, scene.render.engine, scene.render.filepath, {o.name for o in scene.objects}) == before


def test_headless_renders_through_the_same_functions(addon, capture):
    paths = addon("relight.headless").render_relit(capture, ("sun",), resolution=32, samples=1)
    assert paths == [capture / "renders" / "sun.png"] and paths[0].stat().st_size > 500
