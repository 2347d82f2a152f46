# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours that the add-on gives as numbers, in a scene whose working space has other primaries than sRGB: a Blender of
its own runs this file's other tests with an OCIO configuration that works in ACEScg."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures.acting_heads import things, write_head  # noqa: E402
from tests.fixtures.grown_hair import write_strands  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
WIDE = "OCIO" in os.environ
ACESCG = np.array([[0.613097, 0.339523, 0.047379], [0.070194, 0.916354, 0.013452], [0.020616, 0.109570, 0.869815]])
"""Linear Rec.709 to ACEScg, as ACES has it: by Bradford's adaptation from D65."""
NEAR = 2e-3


in_acescg = pytest.mark.skipif(not WIDE, reason="the process of its own")


def working(colour) -> np.ndarray:
    """A linear colour of sRGB's primaries as the scene is to have it."""
    return ACESCG @ colour


def base_colour(material) -> list[float]:
    return list(shader_of(material).inputs["Base Color"].default_value)[:3]


def shader_of(material):
    return next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')


@pytest.mark.skipif(WIDE, reason="this is that process")
def test_the_others_hold_in_acescg(tmp_path):
    configuration = tmp_path / "colours" / "config.ocio"
    shutil.copytree(bpy.utils.system_resource('DATAFILES', path="colormanagement"), configuration.parent)
    text = configuration.read_text(encoding="utf-8")
    for role, usual in (("scene_linear", "Linear Rec.709"), ("default_byte", "sRGB")):
        assert f"  {role}: {usual}\n" in text
        text = text.replace(f"  {role}: {usual}\n", f"  {role}: ACEScg\n")
    configuration.write_text(text, encoding="utf-8")
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(Path(__file__))],
        env={**os.environ, "OCIO": str(configuration)},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    ran = re.search(r"(\d+) passed", result.stdout)
    assert result.returncode == 0 and ran and int(ran[1]) >= 4, result.stdout[-3000:]


@pytest.mark.skipif(WIDE, reason="for a usual configuration")
def test_a_usual_configuration_leaves_colours_as_they_are(addon):
    colours, colour = addon("colours"), np.array([0.1, 0.7, 0.3])
    assert np.array_equal(colours.to_working(colour), colour) and np.array_equal(colours.from_working(colour), colour)


@in_acescg
def test_eyes_teeth_and_hair(addon, capture, few_units):
    acting, materials = addon("acting.materials"), addon("acting.close_up.materials")
    write_head(capture, 1.0)
    for click in ("bring_in_head", "assemble_material", "add_face_units", "close_up"):
        getattr(bpy.ops.wildcap, click)()
    head, strands = bpy.context.view_layer.objects.active, write_strands(capture, addon("acting.asset").load())
    bpy.ops.wildcap.iris(iris='blue')
    bpy.ops.wildcap.grow_hair()
    worn = things(head)
    own, inside = acting.IRISES["blue"], {material.name.split()[-1]: material for material in head.data.materials}
    iris = next(slot.material for slot in worn["Left Eye"].material_slots if "Iris" in slot.material.name)
    assert list(iris.node_tree.nodes["WildCap Iris"].outputs[0].default_value)[:3] == pytest.approx(working(own), NEAR)
    assert list(iris.diffuse_color)[:3] == pytest.approx(working(own), NEAR)
    assert base_colour(worn["Teeth"].material_slots[0].material) == pytest.approx(working(materials.ENAMEL), NEAR)
    assert base_colour(inside["Mouth"]) == pytest.approx(working((0.22, 0.05, 0.045)), NEAR)
    assert base_colour(inside["Teeth"]) == pytest.approx(working((0.66, 0.58, 0.45)), NEAR)
    assert acting.colour_of(head) == own
    picture = inside["Eyes"].node_tree.nodes["WildCap Eye"].image
    assert picture.colorspace_settings.name == "sRGB", "whatever the configuration takes pictures of 8 bits for"

    brown = np.array([[0.05, 0.03, 0.018]], np.float32)
    addon("groom.curves").grow_part(bpy.context, head, "brows", strands["brows"][:1], np.full((1, 5), 4e-5), brown)
    hair = addon("groom.curves").of(head)[0]
    assert list(hair.data.attributes["wildcap_colour"].data[0].color)[:3] == pytest.approx(working(brown[0]), NEAR)
    assert not addon("groom.curves").is_combed(hair)


@in_acescg
def test_lamps_and_skies(addon):
    lights, sky = addon("relight.lights"), addon("relight.sky")
    lamp = lights.PRESETS["coloured"].lamps[1]
    assert list(lights._lamp(lamp, 0.15).data.color) == pytest.approx(working(lamp.colour), NEAR)
    zenith = sky.colours(lights.PRESETS["sun"].sky)[1]
    assert zenith[:3] == pytest.approx(working(lights.PRESETS["sun"].sky.zenith), NEAR) and zenith[3] == 1


@in_acescg
@pytest.mark.parametrize("suffix", [".glb", ".usdc"])
def test_what_an_exporter_writes(addon, tmp_path, suffix):
    """Blender's exporters pass numbers on: a file's are those of sRGB's primaries, unless it says otherwise, as USD
    does from Blender 5.2 on."""
    red = (0.5, 0.1, 0.05)
    material = bpy.data.materials.new("Mouth")
    material.diffuse_color = (*working(red), 1)
    plan = SimpleNamespace(format=SimpleNamespace(suffix=suffix))
    named = suffix == ".usdc" and bpy.app.version >= (5, 2, 0)
    assert base_colour(addon("deliver.stand")._plain(material, plan)) == pytest.approx(
        working(red) if named else red, NEAR
    )


@in_acescg
def test_the_eyedropper_reads_srgb_from_a_map_of_16_bits(addon, tmp_path):
    images = pytest.importorskip("core.imaging.images", reason="the worker's packages write it")
    images.write_srgb(tmp_path / "albedo.png", np.tile(np.float32([0.8, 0.5, 0.3]), (16, 16, 1)), bits=16)
    image = addon("head").load_image(tmp_path / "albedo.png")
    assert image.is_float
    assert addon("solve.eyedropper").colour_at(image, (0.5, 0.5)) == pytest.approx((0.8, 0.5, 0.3), abs=NEAR)
