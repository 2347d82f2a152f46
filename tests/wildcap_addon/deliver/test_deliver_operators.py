# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivering in the add-on: what is told before, what waits, what is refused, and the same from a terminal."""

import shutil
from importlib import import_module
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from tests.fixtures import delivered  # noqa: E402
from tests.fixtures.drawn import drawn  # noqa: E402
from tests.wildcap_addon.deliver.test_deliver import capture, deliver  # noqa: E402, F401  (capture is a fixture)


def test_what_comes_before_the_files_is_told_in_panel_and_dialog(addon, capture):  # noqa: F811
    presets = import_module(f"{addon('deliver').__name__.rsplit('.', 2)[0]}.core.settings.delivery_presets")
    said = " ".join(text for text, _ in drawn(bpy.types.WILDCAP_PT_deliver))
    assert "glTF, one file, m, PNG, 16 bit" in said and "no subsurface scattering" in said
    deliver(capture)
    told = addon("deliver.operators").WILDCAP_OT_deliver.tell(None)
    assert set(presets.FORMATS["glb"].drops) <= set(told) and any("files that you added stay" in line for line in told)


def test_hair_and_close_up_that_a_delivery_leaves_out_are_told(addon, capture):  # noqa: F811
    captures, head = addon("captures"), bpy.context.view_layer.objects.active
    settings, tell = bpy.context.scene.wildcap.captures[0].deliver, addon("deliver.operators").WILDCAP_OT_deliver.tell
    hair, eyes = "The hair stays here", "The close-up eyes and mouth stay here"

    def told() -> list[bool]:
        panel = " ".join(text for text, _ in drawn(bpy.types.WILDCAP_PT_deliver))
        dialog = " ".join(tell(None))
        assert all((words in panel) == (words in dialog) for words in (hair, eyes))
        return [words in panel for words in (hair, eyes)]

    assert told() == [False, False]
    for key, data in (
        (captures.HAIR_KEY, bpy.data.hair_curves.new("Brow")),
        (captures.CLOSE_UP_KEY, bpy.data.meshes.new("Eye")),
    ):
        thing = bpy.data.objects.new(data.name, data)
        bpy.context.scene.collection.objects.link(thing)
        thing.parent, thing[key] = head, "brows"
    assert told() == [True, True]
    settings.format = "usd"
    assert told() == [False, True]
    delivered.in_tiles(capture)
    settings.what = "own_mesh"
    assert told() == [False, False]


def test_a_delivery_waits_for_the_artist_to_leave_a_mode_and_a_failure_keeps_the_old_one(addon, capture, monkeypatch):  # noqa: F811
    folder = deliver(capture)
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    waiting, files = addon("deliver.waiting"), addon("deliver.files")
    with pytest.raises(RuntimeError, match="No delivery waits"):
        bpy.ops.wildcap.finish_delivery()
    operators = addon("deliver.operators")
    plan, root = operators.planned(bpy.context), str(capture.root)
    delivered.deliver(capture)
    bpy.ops.object.mode_set(mode='SCULPT')
    waiting.maps_made(root, plan)
    assert waiting.ready(root) == plan
    bpy.ops.object.mode_set(mode='OBJECT')
    monkeypatch.setattr(files, "_gltf", lambda path: None)
    with pytest.raises(RuntimeError, match="wrote no face.glb"):
        bpy.ops.wildcap.finish_delivery()
    waiting._ready[root] = plan
    with pytest.raises(RuntimeError, match="not there any more"):
        bpy.ops.wildcap.finish_delivery()
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before and not list(capture.exports.glob(".*"))
    shutil.rmtree(folder)
    with pytest.raises(RuntimeError, match="is not there any more"):
        bpy.ops.wildcap.open_delivery()
    waiting.forget()
    with pytest.raises(RuntimeError, match="Nothing has been delivered"):
        bpy.ops.wildcap.open_delivery()


def test_views_selection_and_the_active_object_are_afterwards_as_they_were(capture):  # noqa: F811
    delivered.in_tiles(capture)
    scene, head = bpy.context.scene, bpy.context.view_layer.objects.active
    camera, cube = (
        bpy.data.objects.new(name, data)
        for name, data in (("Camera", bpy.data.cameras.new("Camera")), ("Cube", bpy.data.meshes.new("Cube")))
    )
    for thing in (camera, cube):
        scene.collection.objects.link(thing)
    scene.camera = camera
    space = next(area.spaces.active for area in bpy.context.screen.areas if area.type == 'VIEW_3D')
    space.region_3d.view_perspective = 'CAMERA'
    cube.select_set(True)
    head.select_set(False)
    for what in ("own_mesh", "head"):
        scene.wildcap.captures[0].deliver.what = what
        assert bpy.ops.wildcap.deliver() == {'FINISHED'}
        assert space.region_3d.view_perspective == 'CAMERA' and scene.camera == camera
        assert bpy.context.view_layer.objects.active == head and bpy.context.selected_objects == [cube]


def test_a_blender_without_an_exporter_says_so(addon, capture, monkeypatch, tmp_path):  # noqa: F811
    files = addon("deliver.files")
    problem = import_module(f"{files.__name__.split('.wildcap_addon')[0]}.core.capture.messages").Problem
    monkeypatch.setitem(files.ADDONS, ".glb", "none of these")
    with pytest.raises(problem, match="switched off"):
        files.check(".glb")
    monkeypatch.setattr(files, "has_usd", lambda: False)
    with pytest.raises(problem, match="without USD"):
        files.check(".usdc")
    with pytest.raises(problem, match="exporter failed"):
        files._call(bpy.ops.export_scene.fbx, tmp_path / "none" / "x.fbx", use_selection=True)


def test_the_terminal_delivers_too(addon, capture, capsys):  # noqa: F811
    root, execute = bpy.context.scene.wildcap.captures[0].path, addon("terminal").execute
    assert execute(["deliver", root, "--preset", "unreal"]) == 0
    made = Path(capsys.readouterr().out.strip().splitlines()[-1])
    assert (made / "face.fbx").is_file() and (made / "textures" / "T_face_BaseColor.png").is_file()
    assert execute(["deliver", root, "--what", "own_mesh"]) == 1
    assert "no fitted mesh of yours" in capsys.readouterr().err
