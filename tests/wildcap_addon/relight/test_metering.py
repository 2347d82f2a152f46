# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exposure of the presets, by balls in the head's place, and of a face; the view of old and new scenes."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from tests.fixtures import standin  # noqa: E402
from tests.fixtures.flat_patch import pixels  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402

LUMINANCE = (0.2126, 0.7152, 0.0722)
LIGHTEST = (0.585, 0.402, 0.33)
"""Skin of L* 72, about the lightest of the measured faces."""


@pytest.fixture
def ball(addon):
    """A ball in a head's place, and the function that gives it a colour and a gloss."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.15, segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    thing = bpy.context.object

    def paint(colour, gloss: float):
        material = bpy.data.materials.new("Ball")
        nodes = addon("node_trees").of(material).nodes
        shader = next(node for node in nodes if node.type == 'BSDF_PRINCIPLED')
        values = {"Base Color": (*colour, 1), "Roughness": 0.45, "IOR": 1.4, "Specular IOR Level": gloss}
        for name, value in values.items():
            shader.inputs[name].default_value = value
        thing.data.materials.clear()
        thing.data.materials.append(material)
        return thing

    return paint


def rendered(addon, thing, light: str, file) -> np.ndarray:
    """Linear pixels [N, 3] of a thing alone under a light."""
    scene = addon("relight.picture").set_up_scene(thing, light, 48, 48)
    scene.render.film_transparent, scene.render.filepath = True, str(file)
    addon("relight.output").as_linear(scene)
    scene.render.image_settings.color_mode = 'RGBA'
    bpy.ops.render.render(scene=scene.name, write_still=True)
    scene.render.film_transparent = False
    everything = addon("data_blocks").load_pixels(file)
    return everything[everything[..., 3] > 0.999][:, :3]


@pytest.mark.parametrize("light", ["three_point", "window", "sun", "overcast", "rim", "coloured"])
def test_a_preset_shows_grey_as_it_is_and_burns_out_no_light_skin(addon, ball, tmp_path, light):
    grey = rendered(addon, ball((0.18,) * 3, 0.0), light, tmp_path / "grey.exr") @ LUMINANCE
    brightest = np.quantile(grey, 0.99)
    assert brightest == pytest.approx(0.18, rel=0.05) if light != "rim" else 0.03 < brightest < 0.18
    skin = rendered(addon, ball(LIGHTEST, 0.5), light, tmp_path / "skin.exr")
    # of a face half a percent: a ball shows more of its edge, which mirrors what is behind it
    assert (skin.max(-1) > 1).mean() < (0.03 if light == "rim" else 0.01)


def test_a_face_is_metered_at_middle_grey_unless_its_gloss_would_burn_out(addon):
    stops_for = addon("relight.metering").stops_for
    assert stops_for(np.full((1000, 3), 0.09)) == pytest.approx(1)
    glossy = np.full((1000, 3), 0.05)
    glossy[:20] = 0.97
    assert stops_for(glossy) == pytest.approx(0, abs=0.01)
    glossy[2:20] = 0.05
    assert stops_for(glossy) > 1, "a few pixels may burn out"
    for nothing in (np.zeros((10, 3)), np.zeros((0, 3))):
        refuses("No light reaches the face", stops_for, nothing)


def test_one_click_exposes_for_the_face_and_the_pictures_follow(addon, capture, head):
    bpy.ops.wildcap.assemble_material()
    props, renders = bpy.context.scene.wildcap, capture / "renders"
    props.resolution, props.samples, props.light, props.view = 32, 16, 'overcast', 'Standard'
    metering, settings = addon("relight.metering"), addon("relight.picture").RenderSettings(64, 1)
    face = metering.face_pixels(head, settings.scene(head, 'overcast'))
    assert face[32, 32] and not face[:3].any() and 0.02 < face.mean() < 0.6
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.expose('EXEC_DEFAULT', True)
    assert not renders.exists() and abs(props.exposure) > 0.1
    bpy.ops.wildcap.render()
    label = f"View transform: Standard, {round(props.exposure, 2):+g} stops".encode()
    assert label in (renders / "overcast.png").read_bytes()
    linear, shown = pixels(renders / "overcast.exr")[12:20, 12:20], pixels(renders / "overcast.png")[12:20, 12:20]
    decoded = addon("colours").srgb_to_linear(shown)
    assert decoded.mean() == pytest.approx(linear.mean() * 2**props.exposure, rel=0.05)
    assert (decoded @ LUMINANCE).mean() == pytest.approx(0.18, abs=0.09)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert bpy.context.scene.wildcap.exposure == 0


def test_a_scene_with_its_first_capture_is_viewed_in_agx_and_an_old_one_as_before(addon, tmp_path):
    props = bpy.context.scene.wildcap
    assert props.view == 'Standard', "what a file without the setting was viewed in"
    addon("captures").add(bpy.context, standin.make(tmp_path / "new.wildcap"))
    assert props.view == 'AgX'
    old = bpy.data.scenes.new("Old").wildcap
    old.captures.add().path = str(tmp_path / "old.wildcap")
    chosen = bpy.data.scenes.new("Chosen").wildcap
    chosen.view = 'Standard'
    for scene in ("Old", "Chosen"):
        with bpy.context.temp_override(scene=bpy.data.scenes[scene]):
            addon("captures").add(bpy.context, tmp_path / "new.wildcap")
    assert old.view == chosen.view == 'Standard'
