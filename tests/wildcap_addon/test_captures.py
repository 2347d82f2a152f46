# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures in a .blend: chosen, dropped, several at once; the link that Save As keeps, and a capture that was moved."""

import ast
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from core.capture import hashes
from core.capture.capture import Capture
from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def items():
    return bpy.context.scene.wildcap.captures


def chosen_source(item) -> str:
    return str(Capture(item.path).source)


@pytest.fixture
def project(addon, tmp_path) -> Path:
    """A saved .blend in "Projekt é", with two solved captures beside it, both heads in the scene."""
    folder = tmp_path / "Projekt é"
    for name in ("anna", "berta"):
        bpy.ops.wildcap.open_capture(directory=str(standin.make(folder / f"{name}.wildcap")))
        bpy.ops.wildcap.bring_in_head()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "face.blend"))
    return folder


def test_the_row_that_is_clicked_is_the_face_of_the_tab_whichever_head_was_active(addon, project):
    props, active = bpy.context.scene.wildcap, addon("captures").active
    heads = [item.head for item in items()]
    for index in (0, 1, 0):
        props.active_index = index
        assert active(bpy.context) == items()[index] and bpy.context.view_layer.objects.active == heads[index]
        assert bpy.context.selected_objects == [heads[index]]
    bpy.ops.object.mode_set(mode='SCULPT')
    props.active_index = 1
    assert bpy.context.mode == 'SCULPT' and bpy.context.view_layer.objects.active == heads[0], (
        "nobody is thrown out of a stroke"
    )
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.data.objects.remove(heads[1])
    props.active_index = 0
    props.active_index = 1
    assert active(bpy.context) == items()[1], "also where its head is not in the scene"


def test_what_is_dropped_becomes_captures(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    for name in ("one.mp4", "TWO.MOV", "notes.txt"):
        (tmp_path / name).write_bytes(b"0")
    shots = tmp_path / "shots"
    shots.mkdir()
    for name in ("a.jpg", "b.JPG"):
        (shots / name).write_bytes(b"0")
    bpy.ops.wildcap.choose_video(
        'INVOKE_DEFAULT', directory=str(tmp_path), files=[{"name": "one.mp4"}, {"name": "TWO.MOV"}]
    )
    assert [chosen_source(item) for item in items()] == [str(tmp_path / "one.mp4"), str(tmp_path / "TWO.MOV")]
    bpy.ops.wildcap.choose_video('INVOKE_DEFAULT', directory=str(shots), files=[{"name": "a.jpg"}, {"name": "b.JPG"}])
    assert len(items()) == 3 and chosen_source(items()[2]) == str(shots) and bpy.context.scene.wildcap.active_index == 2
    with pytest.raises(RuntimeError, match="neither a video nor a photograph"):
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "notes.txt"))
    with pytest.raises(RuntimeError, match="no photographs"):
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path))


def test_drops_are_taken_where_the_tab_is_shown(addon):
    source = addon("capture.source")
    # not imported: it needs OpenCV
    path = Path(__file__).parents[2] / "core" / "stages" / "frames" / "photographs.py"
    stage = ast.parse(path.read_text(encoding="utf-8"))
    unread = next(
        ast.literal_eval(node.value)
        for node in stage.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "UNREAD"
    )
    assert set(source.PHOTOGRAPHS) == {*hashes.PHOTOGRAPHS, *unread}

    def taken(tab: str) -> bool:
        space = SimpleNamespace(show_region_ui=bool(tab))
        sidebar = SimpleNamespace(type='UI', active_panel_category=tab)
        area = SimpleNamespace(type='VIEW_3D', spaces=SimpleNamespace(active=space), regions=[sidebar])
        return handler.poll_drop(SimpleNamespace(area=area))

    handler = source.WILDCAP_FH_source
    assert taken("WildCap") and not taken("Item") and not taken("")
    assert not handler.poll_drop(SimpleNamespace(area=SimpleNamespace(type='IMAGE_EDITOR')))
    assert set(handler.bl_file_extensions.split(";")) == {*source.VIDEOS, *source.PHOTOGRAPHS}


def test_the_active_head_says_which_of_several_captures_is_meant(addon, project):
    captures = addon("captures")
    assert captures.active(bpy.context).name == "berta"
    bpy.context.view_layer.objects.active = bpy.data.objects["anna"]
    assert captures.active(bpy.context).name == "anna"
    bpy.context.view_layer.objects.active = None
    bpy.context.scene.wildcap.active_index = 1
    assert captures.active(bpy.context).name == "berta"


def test_what_a_head_wears_means_its_face_as_the_head_does(addon, project):
    active, heads = addon("captures").active, [item.head for item in items()]
    hair = bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair"))
    tie = bpy.data.objects.new("Tie", None)
    for thing, parent in ((hair, heads[0]), (tie, hair)):
        bpy.context.scene.collection.objects.link(thing)
        thing.parent = parent
    for thing in (hair, tie):
        bpy.context.scene.wildcap.active_index = 1
        bpy.context.view_layer.objects.active = thing
        assert active(bpy.context) == items()[0]
        bpy.context.scene.wildcap.active_index = 1  # a click in the list
        assert active(bpy.context) == items()[1] and bpy.context.view_layer.objects.active == heads[1]
    bpy.data.objects.remove(heads[1])
    bpy.context.view_layer.objects.active = hair
    bpy.context.scene.wildcap.active_index = 1
    assert active(bpy.context) == items()[1], "also where its head is not in the scene"
    bpy.context.view_layer.objects.active = hair
    bpy.ops.wildcap.open_capture(directory=items()[1].path)
    assert active(bpy.context) == items()[1]


def test_save_as_elsewhere_keeps_the_link(addon, project, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "elsewhere" / "other.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "other.blend"))
    assert [Path(item.path) for item in items()] == [project / "anna.wildcap", project / "berta.wildcap"]
    shutil.move(tmp_path / "elsewhere" / "other.blend", tmp_path / "alone.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "alone.blend"))
    assert [Path(item.path) for item in items()] == [project / "anna.wildcap", project / "berta.wildcap"], (
        "moved alone, it knows where they were"
    )


@pytest.mark.parametrize("kept", [False, True], ids=["moved", "copied"])
def test_a_project_that_was_moved_or_copied_works_on_its_own_captures(addon, project, tmp_path, kept):
    bpy.ops.wildcap.assemble_material()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_empty=True)
    there = tmp_path / "there"
    (shutil.copytree if kept else shutil.move)(project, there)
    bpy.ops.wm.open_mainfile(filepath=str(there / "face.blend"))
    assert [Path(item.path) for item in items()] == [there / "anna.wildcap", there / "berta.wildcap"]
    found = {o.name: Path(o["wildcap_capture"]).parent for o in bpy.context.scene.objects}
    assert found == {"anna": there, "berta": there}
    pictures = [
        Path(bpy.path.abspath(image.filepath)) for image in bpy.data.images if image.source == 'FILE' and image.filepath
    ]
    assert pictures and all(path.is_relative_to(there) and path.is_file() for path in pictures)


def test_a_moved_capture_is_missed_and_one_click_finds_it_and_what_moved_along(addon, project, tmp_path):
    status, next_step, panel, captures = addon("status"), addon("next_step"), addon("panel"), addon("captures")
    archive = tmp_path / "archive"
    archive.mkdir()
    for name in ("anna", "berta"):
        shutil.move(project / f"{name}.wildcap", archive)
    item = captures.active(bpy.context)
    status.of(item)
    status.refresh(bpy.context)
    assert "not there any more" in status.of(item).problem.problem
    assert next_step.next_step(panel.gather(bpy.context, item)).operator == "wildcap.locate_capture"
    with pytest.raises(RuntimeError, match="neither beside"):
        bpy.ops.wildcap.locate_capture()
    with pytest.raises(RuntimeError, match="is not a capture"):
        bpy.ops.wildcap.locate_capture(directory=str(tmp_path))
    bpy.ops.wildcap.locate_capture(directory=str(archive))
    assert [Path(found.path) for found in items()] == [archive / "anna.wildcap", archive / "berta.wildcap"]
    assert captures.active(bpy.context).name == "berta" and not status.of(captures.active(bpy.context)).missing
    with pytest.raises(RuntimeError, match="is where it was"):
        bpy.ops.wildcap.locate_capture()
    shutil.move(archive / "berta.wildcap", project)
    shutil.move(archive / "anna.wildcap", project / "anna.wildcap")
    bpy.ops.wildcap.locate_capture('INVOKE_DEFAULT')  # beside the .blend: no browser
    assert {Path(found.path).parent for found in items()} == {project}


@pytest.mark.parametrize("noted", [False, True])
def test_a_project_that_comes_from_windows_finds_its_captures_and_pictures(addon, project, noted):
    bpy.ops.wildcap.assemble_material()
    links, item = addon("links"), addon("captures").active(bpy.context)
    root, there = project / "berta.wildcap", "C:\\Faces\\berta.wildcap"
    ours = [image for image in bpy.data.images if str(root) in image.filepath]
    assert len(ours) == 3
    for image in ours:
        image.filepath = image.filepath.replace(str(root), there.upper()).replace("/", "\\")
    item.registration.template = f"{there}\\template\\mine.obj"
    item.head["wildcap_capture"] = item.path = there
    item.from_blend = "berta.wildcap" if noted else ""
    assert links.find(item) == root and links.name(item) == "berta.wildcap"
    links.follow_on_opening()
    assert item.path == item.head["wildcap_capture"] == str(root)
    assert item.registration.template == str(root / "template" / "mine.obj")
    assert all(Path(image.filepath).is_relative_to(root) and Path(image.filepath).is_file() for image in ours)


def test_what_a_setting_names_in_a_capture_moves_with_it_and_what_it_names_elsewhere_does_not(addon, project, tmp_path):
    item = addon("captures").active(bpy.context)
    for at in (item.path, str(project)):
        item.registration.template, item.deliver.folder = f"{at}/template/mine.obj", f"{at}/out"
        if at == item.path:
            shutil.copytree(item.path, tmp_path / "berta.wildcap")
            before = item.path
            addon("links").move(item, tmp_path / "berta.wildcap")
            assert item.registration.template == str(tmp_path / "berta.wildcap" / "template" / "mine.obj")
            assert item.deliver.folder == str(tmp_path / "berta.wildcap" / "out")
            addon("links").move(item, Path(before))
    addon("links").move(item, tmp_path / "berta.wildcap")
    assert (item.registration.template, item.deliver.folder) == (f"{project}/template/mine.obj", f"{project}/out")


def test_captures_of_an_unsaved_file_go_where_the_preferences_say_and_stay_linked(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "all faces")
    (tmp_path / "face.mp4").write_bytes(b"0")
    bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "face.mp4"))
    (tmp_path / "work").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "work" / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "work" / "scene.blend"))
    assert [item.path for item in items()] == [str(tmp_path / "all faces" / "face.wildcap")]
    (tmp_path / "second.mp4").write_bytes(b"0")
    bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "second.mp4"))
    assert items()[1].path == str(tmp_path / "work" / "second.wildcap")


def test_the_strip_shows_frames_of_the_texture_with_their_sharpness(addon, tmp_path):
    strip, panel = addon("capture.strip"), addon("capture.panel").WILDCAP_PT_frames
    root = standin.make(tmp_path / "face.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(root))
    item = items()[0]
    assert strip.of(item) is None and strip.look(str(root)) and strip.of(item) is None and panel.poll(bpy.context)
    (root / "frames").mkdir()
    frames = [
        {"name": f"{i:05}.png", "selected": i % 4 == 1, "sharpness": 0.05 if i in (5, 6) else 0.2 + i / 1000}
        for i in range(100)
    ]
    for frame in frames[:50]:
        (root / "frames" / frame["name"]).write_bytes(standin.plain((90, 80, 70)))
    (root / "frames" / "frames.json").write_text(json.dumps({"kind": "video", "frames": frames}), encoding="utf-8")
    images = len(bpy.data.images)
    assert strip.look(str(root)) and not strip.look(str(root)), "read once"
    found = strip.of(item)
    assert (found.count, found.used, found.blurred, len(found.frames)) == (100, 25, 2, strip.MOST_FRAMES)
    assert [frame.name for frame in found.frames][:4] == ["00001", "00009", "00017", "00025"]
    assert found.frames[0].sharpness == pytest.approx(0.201 / 0.299) and not found.frames[0].blurred
    # icons have no numbers without a window
    shown = {str(root / "frames" / f"{frame.name}.png") for frame in found.frames}
    known = {path for path in addon("frame_icons")._icons if path.startswith(str(root))}
    assert known == {path for path in shown if Path(path).is_file()} and 3 < len(known) < len(shown)
    assert len(bpy.data.images) == images
