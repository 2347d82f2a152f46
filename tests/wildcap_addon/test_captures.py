# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures in a .blend: chosen, dropped, several at once; the link that Save As keeps, and a capture that was moved."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def items():
    return bpy.context.scene.wildcap.captures


def paths() -> list[Path]:
    return [Path(item.path) for item in items()]


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
    props, active, objects = bpy.context.scene.wildcap, addon("captures").active, bpy.context.view_layer.objects
    heads = [item.head for item in items()]
    for index in (0, 1, 0):
        props.active_index = index
        assert active(bpy.context) == items()[index] and bpy.context.selected_objects == [objects.active]
        assert objects.active == heads[index]
    bpy.ops.object.mode_set(mode='SCULPT')
    props.active_index = 1
    assert bpy.context.mode == 'SCULPT' and objects.active == heads[0], "nobody is thrown out of a stroke"
    bpy.ops.object.mode_set(mode='OBJECT')


def test_what_is_dropped_becomes_captures(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    shots = tmp_path / "shots"
    shots.mkdir()
    for path in (tmp_path / "one.mp4", tmp_path / "TWO.MOV", tmp_path / "notes.txt", shots / "a.jpg", shots / "b.JPG"):
        path.write_bytes(b"0")
    for folder, names in ((tmp_path, ("one.mp4", "TWO.MOV")), (shots, ("a.jpg", "b.JPG"))):
        files = [{"name": name} for name in names]
        bpy.ops.wildcap.choose_video('INVOKE_DEFAULT', directory=str(folder), files=files)
    assert [Capture(path).source for path in paths()] == [tmp_path / "one.mp4", tmp_path / "TWO.MOV", shots]
    assert bpy.context.scene.wildcap.active_index == 2
    bpy.ops.wildcap.choose_video(filepath=str(shots / "b.JPG"), alone=True)
    assert Capture(paths()[-1]).source == shots / "b.JPG", "not all in its folder"
    for path, words in (
        (tmp_path / "notes.txt", "neither a video nor a photograph"),
        (tmp_path, "no photographs"),
        (tmp_path / "none.mp4", "no file or folder"),
    ):
        refuses(words, bpy.ops.wildcap.choose_video, filepath=str(path))


def test_drops_are_taken_where_the_tab_is_shown(addon):
    source = addon("capture.source")
    handler = source.WILDCAP_FH_source

    def is_taken(tab: str, kind: str = 'VIEW_3D') -> bool:
        space = SimpleNamespace(show_region_ui=bool(tab))
        sidebar = SimpleNamespace(type='UI', active_panel_category=tab)
        area = SimpleNamespace(type=kind, spaces=SimpleNamespace(active=space), regions=[sidebar])
        return handler.poll_drop(SimpleNamespace(area=area))

    assert is_taken("WildCap") and not is_taken("Item") and not is_taken("")
    assert not is_taken("WildCap", 'IMAGE_EDITOR')
    assert set(handler.bl_file_extensions.split(";")) == {*source.VIDEOS, *source.PHOTOGRAPHS}


def test_what_is_active_means_its_face_and_what_a_head_wears_means_the_head_s(addon, project):
    active, heads = addon("captures").active, [item.head for item in items()]
    objects, props = bpy.context.view_layer.objects, bpy.context.scene.wildcap
    hair = bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair"))
    tie = bpy.data.objects.new("Tie", None)
    for thing, parent in ((hair, heads[0]), (tie, hair)):
        bpy.context.scene.collection.objects.link(thing)
        thing.parent = parent
    for thing in (heads[0], hair, tie):
        props.active_index = 1
        objects.active = thing
        assert active(bpy.context) == items()[0]
        props.active_index = 1  # a click in the list
        assert active(bpy.context) == items()[1] and objects.active == heads[1]
    bpy.data.objects.remove(heads[1])
    objects.active = hair
    props.active_index = 1
    assert active(bpy.context) == items()[1], "also where its head is not in the scene"
    objects.active = hair
    bpy.ops.wildcap.open_capture(directory=items()[1].path)
    assert active(bpy.context) == items()[1]


def test_save_as_elsewhere_keeps_the_link(addon, project, tmp_path):
    captures = [project / "anna.wildcap", project / "berta.wildcap"]
    elsewhere = tmp_path / "elsewhere" / "other.blend"
    elsewhere.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(elsewhere))
    bpy.ops.wm.open_mainfile(filepath=str(elsewhere))
    assert paths() == captures
    shutil.move(elsewhere, tmp_path / "alone.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "alone.blend"))
    assert paths() == captures, "moved alone, it knows where they were"


@pytest.mark.parametrize("kept", [False, True], ids=["moved", "copied"])
def test_a_project_that_was_moved_or_copied_works_on_its_own_captures(addon, project, tmp_path, kept):
    bpy.ops.wildcap.assemble_material()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_empty=True)
    there = tmp_path / "there"
    (shutil.copytree if kept else shutil.move)(project, there)
    bpy.ops.wm.open_mainfile(filepath=str(there / "face.blend"))
    assert paths() == [there / "anna.wildcap", there / "berta.wildcap"]
    assert [Path(o["wildcap_capture"]).parent for o in bpy.context.scene.objects] == [there, there]
    images = [image for image in bpy.data.images if image.source == 'FILE' and image.filepath]
    pictures = [Path(bpy.path.abspath(image.filepath)) for image in images]
    assert pictures and all(path.is_relative_to(there) and path.is_file() for path in pictures)


def test_a_moved_capture_is_missed_and_one_click_finds_it_and_what_moved_along(addon, project, tmp_path):
    status, captures, locate = addon("status"), addon("captures"), bpy.ops.wildcap.locate_capture
    archive = tmp_path / "archive"
    archive.mkdir()
    for name in ("anna", "berta"):
        shutil.move(project / f"{name}.wildcap", archive)
    item = captures.active(bpy.context)
    status.of(item)
    status.refresh(bpy.context)
    assert status.of(item).missing and status.of(item).problem.remedy
    assert addon("next_step").next_step(addon("panel").gather(bpy.context, item)).operator == "wildcap.locate_capture"
    refuses("neither beside", locate)
    refuses("is not a capture", locate, directory=str(tmp_path))
    locate(directory=str(archive))
    assert paths() == [archive / "anna.wildcap", archive / "berta.wildcap"]
    assert captures.active(bpy.context).name == "berta" and not status.of(captures.active(bpy.context)).missing
    refuses("is where it was", locate)
    for name in ("anna", "berta"):
        shutil.move(archive / f"{name}.wildcap", project)
    locate('INVOKE_DEFAULT')  # beside the .blend: no browser
    assert {path.parent for path in paths()} == {project}


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
    item, move = addon("captures").active(bpy.context), addon("links").move
    before, after = Path(item.path), tmp_path / "berta.wildcap"
    shutil.copytree(before, after)
    for named, moved in ((before, after), (project, project)):
        item.registration.template, item.deliver.folder = str(named / "template" / "mine.obj"), str(named / "out")
        move(item, after)
        assert item.registration.template == str(moved / "template" / "mine.obj")
        assert item.deliver.folder == str(moved / "out")
        move(item, before)


def test_captures_of_an_unsaved_file_go_where_the_preferences_say_and_stay_linked(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "all faces")
    blend = tmp_path / "work" / "scene.blend"
    blend.parent.mkdir()
    for name in ("face.mp4", "second.mp4"):
        (tmp_path / name).write_bytes(b"0")
    bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "face.mp4"))
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "second.mp4"))
    assert paths() == [tmp_path / "all faces" / "face.wildcap", tmp_path / "work" / "second.wildcap"]
