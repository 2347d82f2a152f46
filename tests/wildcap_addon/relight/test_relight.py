# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Assemble Material and Render in the bpy wheel: node trees compared as text, pictures by their brightness."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from tests.fixtures import node_text  # noqa: E402
from tests.fixtures.flat_patch import pixels  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402


@pytest.fixture
def skin(head):
    """The head's material."""
    bpy.ops.wildcap.assemble_material()
    return head.data.materials[0]


def resize(head, *scale: float) -> float:
    """Scale the head and assemble its material; return its scattering's length."""
    head.scale = scale
    bpy.context.view_layer.update()
    bpy.ops.wildcap.assemble_material()
    return head.data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Subsurface Scale"].default_value


def test_assembling_again_keeps_the_artists_values_and_makes_nothing_new(skin):
    def state() -> list:
        counts = [len(getattr(bpy.data, kind)) for kind in ("images", "materials", "node_groups")]
        return [*node_text.lines(skin.node_tree), counts]

    roughness = skin.node_tree.nodes["WildCap Skin"].inputs["Roughness"]
    roughness.default_value = 0.3
    before = state()
    bpy.ops.wildcap.assemble_material()
    assert state() == before and roughness.default_value == pytest.approx(0.3)


def test_somebody_elses_material_is_replaced_but_not_changed(addon, head):
    other = head.data.materials[0] = bpy.data.materials.new("Mine")
    addon("node_trees").of(other)
    bpy.ops.wildcap.assemble_material()
    assert head.data.materials[0] != other and len(other.node_tree.nodes) == 2


def test_scattering_follows_the_heads_size_at_each_click_unless_the_artist_set_it(head):
    assert resize(head, 10, 10, 10) == pytest.approx(0.03) and resize(head, 2, 2, 2) == pytest.approx(0.006)
    head.data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Subsurface Scale"].default_value = 0.001
    assert resize(head, 1, 1, 1) == pytest.approx(0.001)


@pytest.mark.parametrize(("scale", "looks"), [((-1, 1, 1), -1), ((2, -2, 2), 1)])
def test_a_mirrored_head_scatters_light_and_is_seen_from_in_front(addon, head, scale, looks):
    """Exchanged left for right it looks towards -Y as before, back for front towards +Y, upright both times."""
    assert resize(head, *scale) == pytest.approx(0.003 * abs(scale[0]))
    camera = addon("relight.picture").set_up_scene(head, "three_point", 16, 1).camera
    assert looks * (camera.matrix_world.translation.y - head.bound_box[0][1]) > 0.3
    assert camera.matrix_world.col[1].z > 0.9, "its up is up"


def test_a_render_is_written_and_the_scene_is_untouched(capture, skin):
    def state() -> tuple:
        names = {thing.name for thing in scene.objects}
        return scene.camera, scene.world, scene.render.engine, scene.render.filepath, names

    scene, renders = bpy.context.scene, capture / "renders"
    before, props = state(), scene.wildcap
    props.resolution, props.samples = 32, 4
    for light in ("three_point", "overcast", "rim"):
        props.light = light
        bpy.ops.wildcap.render()
        assert 0.1 < pixels(renders / f"{light}.png")[12:20, 12:20].mean() < 0.95, light
    assert not [path for path in renders.iterdir() if path.name.startswith(".")] and state() == before


def test_a_head_that_was_rendered_can_be_deleted_from_the_file(addon, skin, head, tmp_path):
    file, props = str(tmp_path / "shot.blend"), bpy.context.scene.wildcap
    brow = bpy.data.objects.new("Brow", bpy.data.hair_curves.new("Brow"))
    bpy.context.scene.collection.objects.link(brow)
    brow.parent, brow[addon("captures").HAIR_KEY] = head, "brows"
    settings = addon("relight.picture").RenderSettings(16, 1)
    assert {head, brow} < set(settings.scene(head, "sun").collection.objects)
    props.resolution = props.samples = 1
    bpy.ops.wildcap.render()
    assert head.users_scene == brow.users_scene == (bpy.context.scene,)
    bpy.ops.object.delete()
    bpy.data.objects.remove(brow)
    bpy.ops.wildcap.close_capture()
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    assert not bpy.data.meshes and not [image.name for image in bpy.data.images if image.source == 'FILE']


def test_lights_that_are_set_up_again_leave_nothing_of_those_before(addon, head):
    settings = addon("relight.picture").RenderSettings(16, 1)
    for _ in range(3):
        settings.scene(head, "three_point")
        addon("relight.reel").animate_turn(head, "sun", 'LIGHT', 4, settings)
    rigs = [thing for thing in bpy.data.objects if thing.name.startswith("WildCap Lights")]
    assert len(rigs) == 1 and len(bpy.data.lights) == 1 and not [a.name for a in bpy.data.actions if not a.users]


def test_headless_renders_a_picture_and_its_linear_twin(addon, capture):
    headless = addon("relight.headless")
    paths = headless.render_relit(capture, ("studio", "overcast"), resolution=32, samples=1)
    assert paths == [capture / "renders" / f"{name}.png" for name in ("studio", "overcast")]
    for path in paths:
        assert b"tEXtNote\0View transform: Standard" in path.read_bytes()
        linear = pixels(path.with_suffix(".exr"))
        encoded = np.where(linear > 0.0031308, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055, 12.92 * linear)
        off = np.abs(np.clip(encoded, 0, 1) - pixels(path)).max()
        assert off < 2.5 / 255, "the same render: linear, and as sRGB without a look, dithered"
    assert headless.light_of("sunset").path.is_file(), "one of Blender's worlds"


def test_an_overcast_sky_is_thrice_as_bright_above_as_at_the_horizon(addon, capture):
    """The world alone, looked at up, half up and down."""
    sky, scene = addon("relight.sky"), bpy.context.scene
    preset = addon("relight.lights").PRESETS["overcast"].sky
    assert preset.zenith[1] == pytest.approx(3 * preset.horizon[1], rel=0.05)
    scene.world = sky.world()
    sky.show(scene.world, preset, addon("relight.picture").Matrix())
    scene.camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    scene.collection.objects.link(scene.camera)
    scene.camera.data.angle = 0.02
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = 'CYCLES', 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format, scene.render.use_file_extension = 'OPEN_EXR', False
    scene.render.filepath = str(capture / "sky.exr")
    halfway = np.add(preset.zenith, preset.horizon) / 2  # at 30 degrees, where the sine is one half
    for pitch, expected in ((180, preset.zenith), (120, halfway), (0, preset.ground)):
        scene.camera.rotation_euler = (np.radians(pitch), 0, 0)
        bpy.ops.render.render(write_still=True)
        assert pixels(capture / "sky.exr").mean((0, 1)) == pytest.approx(expected, rel=0.02)


def test_the_panel_names_every_preset_and_old_files_keep_theirs(addon):
    lights, scene = addon("relight.lights"), bpy.context.scene
    assert sorted(name for name, *_ in addon("properties").LIGHTS) == sorted([*lights.PRESETS, "hdri"])
    if bpy.app.version < (5, 0, 0):  # Blender 5 keeps what is stored out of a script's reach
        for number, name in enumerate(("three_point", "sun", "window", "hdri")):  # 0 was named studio
            scene.wildcap["light"] = number
            assert scene.wildcap.light == name


def test_the_surroundings_of_a_picture_light_the_head_and_turn_with_their_rotation(
    addon, capture, head, tmp_path, monkeypatch
):
    """A panorama that is bright towards +X alone: the head's left, at the right of the picture; a quarter turn
    clockwise it is before the face, a quarter turn counter-clockwise it is behind."""
    panorama, light = bpy.data.images.new("side", 64, 32, float_buffer=True), np.zeros((32, 64, 4), np.float32)
    light[8:24, 24:40, :3] = 3.0  # the middle of a panorama is +X
    panorama.pixels.foreach_set(light.ravel())
    panorama.file_format, panorama.filepath_raw = 'OPEN_EXR', str(tmp_path / "side.exr")
    panorama.save()
    props, lights = bpy.context.scene.wildcap, addon("relight.lights")
    props.light, props.hdri_file, props.resolution, props.samples = 'hdri', str(tmp_path / "side.exr"), 48, 8

    def light_with(world, *arguments, show=lights.light_with):
        show(world, *arguments)
        world.cycles.sampling_method = 'NONE'  # its map of where the light is would take seconds

    monkeypatch.setattr(lights, "light_with", light_with)
    columns = []
    for rotation in (0.0, -np.pi / 2, np.pi / 2):
        props.hdri_rotation = rotation
        bpy.ops.wildcap.render()
        columns.append(pixels(capture / "renders" / "side.png")[16:32].mean((0, 2)))
    beside, before, behind = (column[14:34].mean() for column in columns)
    assert columns[0][26:34].mean() > 1.5 * columns[0][14:22].mean() and before > beside > 2 * behind, columns
    props.hdri_file = str(tmp_path / "gone.exr")
    refuses(r"gone\.exr", bpy.ops.wildcap.render)
    props.hdri_file = ""
    assert addon("hdri").chosen_hdri(props).path.is_file(), "one of Blender's own worlds"
    assert len(bpy.data.scenes["WildCap Relight"].world.node_tree.nodes) == 5


def test_filmed_delit_and_solved_are_shown_in_the_same_material(addon, capture, head):
    refuses("Assemble Material", bpy.ops.wildcap.compare, show='FILMED')
    bpy.ops.wildcap.assemble_material()
    compare, tree = addon("relight.compare"), head.data.materials[0].node_tree
    solved = node_text.lines(tree)
    refuses(r"filmed\.png", bpy.ops.wildcap.compare, show='FILMED')
    (capture / "comparison").mkdir()
    for kind, name in (('FILMED', "filmed.png"), ('DELIT', "delit.png"), ('SOLVED', "diffuse_albedo.png")):
        (capture / "comparison" / name).write_bytes((capture / "texture.png").read_bytes())
        bpy.ops.wildcap.compare(show=kind)
        assert compare.shown_picture(bpy.context) == kind
        assert node_text.lines(tree) == sorted(line.replace("diffuse_albedo.png", name) for line in solved)
