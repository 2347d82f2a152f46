# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in the bpy wheel: registering, captures, painting's file side, material, render, jobs. The real window is tests/gui/."""

import importlib.util
import json
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

TESTS = Path(__file__).parent
ROOT = TESTS.parent


def _standin():
    spec = importlib.util.spec_from_file_location("wildcap_standin", TESTS / "standin.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


standin = _standin()


@pytest.fixture
def addon(wildcap):
    """import_module inside the add-on."""
    return lambda name: import_module(f"{wildcap}.wildcap_addon.{name}")


@pytest.fixture
def capture(tmp_path, wildcap):
    """An open, solved capture in a folder with a space and an accent."""
    root = standin.make(tmp_path / "Zoë et moi" / "head.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(root))
    return root


def registered() -> set[str]:
    names = {name for kind in (bpy.types.Operator, bpy.types.Panel, bpy.types.UIList, bpy.types.PropertyGroup, bpy.types.AddonPreferences)
             for name in (c.__name__ for c in kind.__subclasses__()) if name.startswith("WILDCAP")}
    return {name for name in names if hasattr(bpy.types, name)} | {"Scene.wildcap"} & {"Scene.wildcap" if hasattr(bpy.types.Scene, "wildcap") else ""}


def handlers() -> int:
    return sum(getattr(f, "__module__", "").startswith("bl_ext.user_default.wildcap") for name in dir(bpy.app.handlers)
               for f in (getattr(bpy.app.handlers, name) if isinstance(getattr(bpy.app.handlers, name), list) else ()))


def test_disabling_leaves_nothing_and_enabling_again_works(wildcap):
    import addon_utils

    before = registered()
    assert {"WILDCAP_PT_main", "WILDCAP_OT_solve", "Scene.wildcap"} <= before
    assert handlers() > 0
    addon_utils.disable(wildcap, default_set=True)
    assert registered() == set()
    assert handlers() == 0
    addon_utils.enable(wildcap, default_set=True)
    assert registered() == before


def test_the_properties_are_those_of_the_settings(addon):
    properties = addon("properties")
    settings = properties.core_settings
    bpy.context.scene.wildcap.captures.add()
    item = bpy.context.scene.wildcap.captures[0]
    assert properties.settings(item) == settings.Settings()
    for stage, kind in properties.STAGE_KINDS.items():
        group = getattr(item, stage)
        for name, f in kind.__dataclass_fields__.items():
            rna = group.bl_rna.properties[name]
            assert rna.description == settings.tooltips(kind)[name]
            for key, bound in (("min", "hard_min"), ("max", "hard_max")):
                if key in f.metadata and "choices" not in f.metadata:
                    assert getattr(rna, bound) == pytest.approx(f.metadata[key])
            if "choices" in f.metadata:
                assert tuple(e.identifier for e in rna.enum_items) == f.metadata["choices"]


def test_a_quality_sets_the_settings_and_keeps_the_skin_tone(addon):
    properties = addon("properties")
    item = bpy.context.scene.wildcap.captures.add()
    item.use_skin_tone, item.skin_tone = True, (0.5, 0.25, 0.125)
    item.quality = "draft"
    values = properties.values(item)
    draft = properties.core_settings.preset("draft")
    assert values["solve"]["size"] == draft.solve.size
    assert values["solve"]["steps"] == draft.solve.steps
    assert values["solve"]["skin_tone"] == "0.5000,0.2500,0.1250"


def test_choosing_a_video_makes_a_capture_and_the_same_video_finds_it_again(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    video = tmp_path / "Mon visage é.mp4"
    video.write_bytes(b"0")
    bpy.ops.wildcap.choose_video(filepath=str(video))
    bpy.ops.wildcap.choose_video(filepath=str(video))
    root = tmp_path / "captures" / "Mon visage é.wildcap"
    assert json.loads((root / "capture.json").read_text(encoding="utf-8"))["source"] == str(video)
    assert [item.path for item in bpy.context.scene.wildcap.captures] == [str(root)]


def test_another_video_of_the_same_name_gets_its_own_folder(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "face.mp4").write_bytes(b"0")
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path / folder / "face.mp4"))
    assert sorted(p.name for p in (tmp_path / "captures").iterdir()) == ["face.wildcap", "face_2.wildcap"]


def test_a_missing_video_is_a_problem_with_a_remedy(addon, tmp_path):
    with pytest.raises(RuntimeError, match="There is no file or folder"):
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "none.mp4"))
    problem = addon("problems").of("")
    assert problem.problem and problem.remedy


def test_an_unexpected_error_is_shown_as_a_problem(addon, capture, monkeypatch):
    monkeypatch.setattr(addon("head"), "bring_in", lambda *_: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.wildcap.bring_in_head()
    assert "failed unexpectedly" in addon("problems").of(str(capture)).problem


def test_a_capture_of_a_newer_version_is_refused_and_left_alone(addon, tmp_path):
    root = standin.make(tmp_path / "new.wildcap")
    (root / "capture.json").write_text('{"format": 99, "stages": {}}', encoding="utf-8")
    with pytest.raises(RuntimeError, match="newer version"):
        bpy.ops.wildcap.open_capture(directory=str(root))
    assert (root / "capture.json").read_text(encoding="utf-8") == '{"format": 99, "stages": {}}'


def test_the_head_comes_in_upright_with_its_uvs_and_again_in_place(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    assert head["wildcap_capture"] == str(capture)
    assert tuple(head.dimensions) == pytest.approx((0.16, 0.1 - 0.1 * __import__("math").cos(0.8 * 3.14159265), 0.24), abs=2e-3)
    assert head.bound_box[0][1] == pytest.approx(-0.1, abs=1e-4)  # the face, towards -Y
    assert [layer.name for layer in head.data.uv_layers] == ["UVMap"]
    head.location.x = 1.0
    bpy.ops.wildcap.bring_in_head()
    assert [o.name for o in bpy.context.scene.objects] == [head.name]
    assert head.location.x == 1.0


def test_the_mask_painted_on_the_left_cheek_is_saved_on_the_left_cheek(addon, capture):
    import numpy as np

    mask_image = addon("paint.mask_image")
    core_capture = addon("captures").Capture(capture)
    image = mask_image.load(core_capture)
    u, v = standin.LEFT_CHEEK_UV
    width, height = image.size
    pixels = np.zeros((height, width, 4), np.float32)  # Blender's rows, from the bottom
    pixels[..., 3] = 1
    pixels[round(v * height), round(u * width)] = 1
    image.pixels.foreach_set(pixels.ravel())
    mask_image.save(image, core_capture)

    header = (capture / "shadow_mask.png").read_bytes()[24:26]
    assert header == b"\x08\x00", "8 bit grey"
    read = bpy.data.images.load(str(capture / "shadow_mask.png"))
    read.colorspace_settings.name = 'Non-Color'
    again = mask_image.values(read)
    row, column = np.argwhere(again > 0.5)[0]
    assert column > width / 2, "the person's left is right of the middle of the map"
    assert row > height / 2, "the cheek is below the middle"
    assert (row, column) == (height - 1 - round(v * height), round(u * width))
    assert (again > 0.5).sum() == 1


def test_the_last_ten_masks_are_kept(addon, capture):
    import numpy as np

    mask_image = addon("paint.mask_image")
    core_capture = addon("captures").Capture(capture)
    image = mask_image.load(core_capture)
    for i in range(14):
        pixels = np.full(len(image.pixels), i / 14, np.float32)
        image.pixels.foreach_set(pixels)
        mask_image.save(image, core_capture)
    assert len(list((capture / "mask_history").iterdir())) == 10
    mask_image.save(image, core_capture)
    assert len(list((capture / "mask_history").iterdir())) == 10, "an unchanged mask is no new one"


@pytest.mark.parametrize("on", ["HEAD", "SHEET"])
def test_painting_sets_everything_up_and_leaving_puts_it_back(addon, capture, on):
    bpy.ops.wildcap.bring_in_head()
    for mode in ('TEXTURE_PAINT', 'OBJECT'):  # Blender gives the mode its first brush
        bpy.ops.object.mode_set(mode=mode)
    paint = bpy.context.scene.tool_settings.image_paint
    before = {name: getattr(paint, name) for name in ("mode", "canvas", "use_stencil_layer", "stencil_image", "invert_stencil", "brush")}
    objects = {o.name for o in bpy.data.objects}
    bpy.ops.wildcap.paint_mask(on=on)
    assert bpy.context.mode == 'PAINT_TEXTURE'
    assert paint.canvas.name.startswith("texture") and paint.stencil_image.name.endswith("Shadow Mask")
    assert paint.use_stencil_layer and tuple(paint.stencil_color) == (1, 0, 0)
    assert getattr(paint.brush, "image_brush_type", None) == 'MASK' or paint.brush.image_tool == 'MASK'
    bpy.ops.wildcap.paint_mask(on='HEAD' if on == 'SHEET' else 'SHEET')
    assert bpy.context.mode == 'PAINT_TEXTURE'
    bpy.ops.wildcap.finish_mask()
    assert bpy.context.mode == 'OBJECT'
    assert {name: getattr(paint, name) for name in before} == before
    assert {o.name for o in bpy.data.objects} == objects
    assert not any(o.hide_get() for o in bpy.context.view_layer.objects)
    assert (capture / "shadow_mask.png").is_file()
    assert "WildCap Mask" not in bpy.data.brushes


def test_a_mask_is_not_lost_when_another_file_is_opened(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert (capture / "shadow_mask.png").is_file()
    assert not addon("paint.session").active()


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
    import numpy as np

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


def test_the_sample_head_opens_relightable_within_ten_seconds(addon, tmp_path, monkeypatch):
    sample_head = addon("capture.sample_head")
    if not (sample_head.SHIPPED / "head.obj").is_file():
        monkeypatch.setattr(sample_head, "SHIPPED", standin.make(tmp_path / "shipped"))
    addon("preferences").get().captures = str(tmp_path / "captures")
    started = time.monotonic()
    bpy.ops.wildcap.open_sample_head()
    assert time.monotonic() - started < 10
    head = bpy.context.view_layer.objects.active
    assert "WildCap Skin" in head.data.materials[0].node_tree.nodes
    assert head["wildcap_capture"] == str(tmp_path / "captures" / "sample_head.wildcap")


def test_a_python_that_lacks_packages_is_refused_by_name(addon, tmp_path):
    operators = addon("setup.operators")
    with pytest.raises(Exception, match="There is no Python"):
        operators.interpreter(tmp_path)
    venv = tmp_path / "bare"
    import venv as venv_module

    venv_module.create(venv, with_pip=False, symlinks=True)
    with pytest.raises(RuntimeError, match="torch .* is missing"):
        bpy.ops.wildcap.use_python(filepath=str(venv))
    assert addon("preferences").get().python == ""


def test_a_job_without_a_solver_python_says_so(addon, capture):
    addon("preferences").get().python = ""
    with pytest.raises(RuntimeError, match="solver is not set up"):
        bpy.ops.wildcap.solve()


def test_a_failing_job_ends_as_a_problem_of_its_capture(addon, tmp_path):
    video = tmp_path / "not a video.mp4"
    video.write_text("no video", encoding="utf-8")
    preferences = addon("preferences").get()
    preferences.python, preferences.captures = sys.executable, str(tmp_path / "captures")
    bpy.ops.wildcap.choose_video(filepath=str(video))
    bpy.ops.wildcap.reconstruct()
    jobs = addon("jobs")
    root = str(tmp_path / "captures" / "not a video.wildcap")
    assert jobs.of(root).goal == "reconstruct"
    assert not bpy.ops.wildcap.reconstruct.poll(), "one job per capture"
    deadline = time.monotonic() + 60
    while jobs.poll():
        assert time.monotonic() < deadline, "the worker never ended"
        time.sleep(0.05)
    problem = addon("problems").of(root)
    assert problem is not None and problem.remedy
    preferences.python = ""


def test_cancel_ends_a_job_within_two_seconds(addon, capture):
    preferences = addon("preferences").get()
    preferences.python = sys.executable
    bpy.ops.wildcap.solve()
    jobs = addon("jobs")
    bpy.ops.wildcap.cancel()
    started = time.monotonic()
    while jobs.poll():
        assert time.monotonic() - started < 2.5
        time.sleep(0.05)
    assert "Cancelled" in addon("problems").of(str(capture)).problem
    preferences.python = ""


class FakeLayout:
    """Counts what a panel draws; every call is a layout again."""

    def __init__(self):
        self.drawn = []

    def __getattr__(self, name):
        def call(*args, **kwargs):
            self.drawn.append((name, args, kwargs))
            return self
        return call

    def __setattr__(self, name, value):
        object.__setattr__(self, name, value)


def test_every_panel_draws_in_every_state(addon, capture):
    status = addon("status")
    base = addon("base_panel").WildcapPanel
    classes = [c for c in bpy.types.Panel.__subclasses__() if issubclass(c, base)]
    assert len(classes) >= 8

    def draw_all():
        seen = []
        for cls in classes:
            if not hasattr(cls, "poll") or cls.poll(bpy.context):
                layout = FakeLayout()
                cls.draw(type("Panel", (), {"layout": layout})(), bpy.context)
                seen += layout.drawn
        return [kwargs.get("text", args[1] if len(args) > 1 else "") for name, args, kwargs in seen if name == "operator"]

    draw_all()
    status.refresh(bpy.context)
    assert "Bring In Head" in draw_all()
    bpy.ops.wildcap.bring_in_head()
    assert "Assemble Material" in draw_all()
    bpy.ops.wildcap.paint_mask()
    assert "Save Mask and Leave" in draw_all()
    bpy.ops.wildcap.finish_mask()
    bpy.ops.wildcap.assemble_material()
    assert "Render" in draw_all()


def test_the_solver_is_not_downloaded_while_blender_works_offline(addon):
    assert not bpy.app.online_access
    with pytest.raises(RuntimeError, match="work offline"):
        bpy.ops.wildcap.install_solver()
    assert addon("jobs").of("") is None


def test_an_installation_is_polled_like_a_job_and_sets_the_python(addon, tmp_path):
    jobs, preferences = addon("jobs"), addon("preferences")
    messages = jobs.messages

    class Installation:
        """Says what a real one says, without a download."""

        running = True

        def start(self):
            self.waiting = [messages.Progress("environment", 1, 2, "Collecting torch"), messages.Done(1.0)]

        def poll(self):
            said = [self.waiting.pop(0)]
            self.running = bool(self.waiting)
            return said

    jobs.begin("", "install", Installation(), lambda: preferences.set_python(Path(sys.executable)))
    assert jobs.poll() and jobs.of("").progress.text == "Collecting torch"
    assert not jobs.poll()
    assert preferences.python() == Path(sys.executable)
    preferences.set_python(None)


def test_the_solver_goes_to_the_extensions_user_folder_and_only_environments_are_removed(addon, tmp_path):
    preferences = addon("preferences")
    assert preferences.environment_folder().parts[-4:] == (".user", "user_default", "wildcap", "solver")
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "novel.txt").write_text("", encoding="utf-8")
    preferences.get().environment = str(mine)
    with pytest.raises(RuntimeError, match="is not a Python environment"):
        bpy.ops.wildcap.remove_solver()
    preferences.get().environment = ""
    assert (mine / "novel.txt").is_file()
