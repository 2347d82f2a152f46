# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivering in the add-on: what is said before, what waits, what is refused, and the same from a terminal."""

import shutil
from importlib import import_module
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from tests.fixtures import delivered  # noqa: E402
from tests.fixtures.drawn import drawn  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402

HAIR, CLOSE_UP = "The hair stays here", "The close-up eyes and mouth stay here"


def said(addon) -> tuple[str, str]:
    """Return the texts of the panel and of the dialog."""
    panel = " ".join(text for text, _ in drawn(bpy.types.WILDCAP_PT_deliver))
    return panel, " ".join(addon("deliver.operators").WILDCAP_OT_deliver.tell(None))


def test_panel_and_dialog_name_the_files_and_what_is_left_out(addon, capture, deliver):
    captures, head = addon("captures"), bpy.context.view_layer.objects.active
    presets = import_module(f"{addon('deliver').__name__.rsplit('.', 2)[0]}.core.settings.delivery_presets")
    settings = bpy.context.scene.wildcap.captures[0].deliver

    def left_out() -> list[bool]:
        panel, dialog = said(addon)
        assert all((words in panel) == (words in dialog) for words in (HAIR, CLOSE_UP))
        return [words in panel for words in (HAIR, CLOSE_UP)]

    assert "glTF, one file, m, PNG, 16 bit" in said(addon)[0] and left_out() == [False, False]
    deliver()
    assert all(sentence in text for sentence in presets.FORMATS["glb"].drops for text in said(addon))
    assert "files that you added stay" in said(addon)[1]
    for key, data in (
        (captures.HAIR_KEY, bpy.data.hair_curves.new("Brow")),
        (captures.CLOSE_UP_KEY, bpy.data.meshes.new("Eye")),
    ):
        thing = bpy.data.objects.new(data.name, data)
        bpy.context.scene.collection.objects.link(thing)
        thing.parent, thing[key] = head, "brows"
    assert left_out() == [True, True]
    settings.format = "usd"
    assert left_out() == [False, True]
    delivered.in_tiles(capture)
    settings.what = "own_mesh"
    assert left_out() == [False, False]


def test_a_delivery_waits_for_the_artist_to_leave_a_mode_and_a_failure_keeps_the_old_one(
    addon, capture, deliver, monkeypatch
):
    folder = deliver()
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    waiting, files = addon("deliver.waiting"), addon("deliver.files")
    refuses("No delivery waits", bpy.ops.wildcap.finish_delivery)
    plan, root = addon("deliver.operators").planned(bpy.context), str(capture.root)
    delivered.deliver(capture)
    bpy.ops.object.mode_set(mode='SCULPT')
    waiting.maps_made(root, plan)
    assert waiting.ready(root) == plan
    bpy.ops.object.mode_set(mode='OBJECT')
    monkeypatch.setattr(files, "_gltf", lambda path: None)
    refuses(r"no face\.glb", bpy.ops.wildcap.finish_delivery)
    waiting._ready[root] = plan
    refuses("maps of this delivery", bpy.ops.wildcap.finish_delivery)
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before and not list(capture.exports.glob(".*"))
    shutil.rmtree(folder)
    refuses(folder.name, bpy.ops.wildcap.open_delivery)
    waiting.forget()
    refuses("Nothing has been delivered", bpy.ops.wildcap.open_delivery)


def test_views_selection_and_the_active_object_are_afterwards_as_they_were(capture):
    delivered.in_tiles(capture)
    scene, head = bpy.context.scene, bpy.context.view_layer.objects.active
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    for thing in (camera, cube):
        scene.collection.objects.link(thing)
    scene.camera = camera
    space = next(area.spaces.active for area in bpy.context.screen.areas if area.type == 'VIEW_3D')
    space.region_3d.view_perspective = 'CAMERA'
    cube.select_set(True)
    head.select_set(False)
    scene.wildcap.captures[0].deliver.what = "own_mesh"
    assert bpy.ops.wildcap.deliver() == {'FINISHED'}
    assert space.region_3d.view_perspective == 'CAMERA' and scene.camera == camera
    assert bpy.context.view_layer.objects.active == head and bpy.context.selected_objects == [cube]


def test_a_blender_without_an_exporter_says_so(addon, monkeypatch, tmp_path):
    files = addon("deliver.files")
    monkeypatch.setitem(files.ADDONS, ".glb", "none of these")
    refuses("switched off", files.check, ".glb")
    monkeypatch.setattr(files, "has_usd", lambda: False)
    refuses("without USD", files.check, ".usdc")
    refuses("failed", files._call, bpy.ops.export_scene.fbx, tmp_path / "none" / "x.fbx", use_selection=True)


def test_the_terminal_delivers_too(addon, capture, capsys):
    root, execute = bpy.context.scene.wildcap.captures[0].path, addon("terminal").execute
    assert execute(["deliver", root, "--preset", "unreal"]) == 0
    made = Path(capsys.readouterr().out.strip().splitlines()[-1])
    assert (made / "face.fbx").is_file() and (made / "textures" / "T_face_BaseColor.png").is_file()
    assert execute(["deliver", root, "--what", "own_mesh"]) == 1
    assert "no fitted mesh" in capsys.readouterr().err
