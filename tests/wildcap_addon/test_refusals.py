# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on says when something an artist did, lost or damaged is in the way, where no other file tests it."""

from queue import SimpleQueue
from unittest.mock import Mock

import pytest

from core.capture.messages import Problem
from tests.fixtures import standin
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


@pytest.fixture
def session(addon):
    """No painting is under way, nor afterwards."""
    module = addon("paint.session")
    module.forget()
    yield module
    module.forget()


@pytest.mark.parametrize(
    ("lost", "click", "words"),
    [
        ("texture.png", "paint_mask", "no texture"),
        ("shadow_mask_auto.png", "paint_mask", "no shadow mask"),
        ("maps/normal.png", "assemble_material", "no normal.png"),
        ("landmarks.json", "show_landmarks", "no landmarks"),
        ("scan.ply", "bring_in_scan", "no scan"),
        ("delit", "compare_delit", "delit"),
    ],
)
def test_a_part_of_the_capture_that_is_missing(capture, session, lost, click, words):
    bpy.ops.wildcap.bring_in_head()
    (capture / lost).unlink(missing_ok=True)
    refuses(words, getattr(bpy.ops.wildcap, click))
    assert not session.active() and bpy.context.mode == 'OBJECT'


@pytest.mark.parametrize(
    ("damaged", "content", "click", "words"),
    [
        ("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "bring_in_head", "one mesh with UVs"),
        ("shadow_mask.png", "no picture", "paint_mask", "not a picture"),
        ("landmarks.json", "{", "show_landmarks", "landmarks.json cannot be read"),
        ("landmarks.json", "[1]", "show_landmarks", "landmarks.json cannot be read"),
        ("scan.ply", "no mesh", "bring_in_scan", "scan.ply cannot be read"),
    ],
)
def test_a_part_of_the_capture_that_is_damaged(capture, session, damaged, content, click, words):
    (capture / "scan.ply").touch()
    if damaged != "head.obj":
        bpy.ops.wildcap.bring_in_head()
    before = set(bpy.data.objects.keys())
    (capture / damaged).write_text(content, encoding="utf-8")
    refuses(words, getattr(bpy.ops.wildcap, click))
    assert set(bpy.data.objects.keys()) == before and bpy.context.mode == 'OBJECT'


def test_a_frame_that_was_taken_away_after_it_was_delit(capture):
    standin.add_evidence(capture)
    for frame in (capture / "frames").glob("*.jpg"):
        frame.unlink()
    refuses("The frame", bpy.ops.wildcap.compare_delit)


def test_what_is_painted_may_be_lost_on_the_way(addon, capture, item, session):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    (capture / "shadow_mask_auto.png").unlink()
    refuses("no proposal", bpy.ops.wildcap.edit_mask, kind='PROPOSAL')
    image = session.mask()
    image.source = 'FILE'
    image.filepath_raw = str(capture / "none.png")
    image.reload()
    refuses("mask", addon("paint.mask_image").refresh, image, addon("captures").folder(item), 'SHADOW')
    bpy.data.images.remove(image)
    refuses("mask is no longer in this file", bpy.ops.wildcap.edit_mask, kind='INVERT')
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.data.objects.remove(addon("captures").head(bpy.context, item))
    refuses("in this scene", session.begin_painting, bpy.context, item, True)


def test_the_set_up_keeps_its_buttons_while_it_works(addon):
    jobs = addon("jobs")
    jobs._jobs[""] = jobs.Job('ask', Mock())
    refuses("being installed", bpy.ops.wildcap.install_solver)
    refuses("being installed", bpy.ops.wildcap.remove_solver)
    refuses("being set up", bpy.ops.wildcap.use_python, filepath="/none")
    jobs._jobs.clear()


def test_a_second_job_a_look_that_is_not_over_and_no_solver(addon, item):
    jobs = addon("jobs")
    addon("status")._known.clear()
    refuses("Looking at the capture", bpy.ops.wildcap.solve_edited)
    addon("preferences").get().python = ""
    refuses("solver is not set up", bpy.ops.wildcap.solve)
    jobs._jobs[addon("captures").root(item)] = jobs.Job('solve', Mock())
    refuses("being worked on", jobs.start, item, "solve")
    refuses("click Cancel", bpy.ops.wildcap.solve)
    jobs._jobs.clear()


def test_a_folder_that_cannot_be_looked_at(addon, capture, monkeypatch):
    status = addon("status")
    folder = status.Capture(capture)
    monkeypatch.setattr(status.Capture, "read", Mock(side_effect=OSError(5, "Input/output error")))
    assert "cannot be read (Input/output error)" in status.look(folder, None).problem.problem
    monkeypatch.setattr(status, "look", lambda *_: 1 / 0)
    monkeypatch.setattr(status, "_found", SimpleQueue())  # a test before this one may have left a look of its own
    status._look_aside(str(capture), "", folder, None)
    assert "cannot be read (division by zero)" in status._found.get_nowait()[2].problem.problem


def test_an_installation_without_its_sample_head(addon, monkeypatch, tmp_path):
    monkeypatch.setattr(addon("capture.sample_head").sample_head, "SHIPPED", tmp_path / "none")
    addon("preferences").get().captures = str(tmp_path)
    refuses("sample head is missing", bpy.ops.wildcap.open_sample_head)


def test_a_thousand_captures_of_one_name(addon, tmp_path, monkeypatch):
    monkeypatch.setattr("pathlib.Path.exists", lambda self: True)
    refuses("a thousand captures", addon("capture.source").new_folder, tmp_path, tmp_path / "face")


def test_a_blender_without_surroundings(addon, monkeypatch):
    hdri, props = addon("hdri"), bpy.context.scene.wildcap
    props.hdri_file = ""
    monkeypatch.setattr(hdri, "_worlds", lambda: [])
    refuses("without pictures", hdri.chosen_hdri, props)


def test_without_a_face_there_is_nothing_to_work_on(addon):
    with pytest.raises(Exception, match="no face to work on yet") as refusal:
        addon("captures").require(bpy.context)
    assert type(refusal.value).__name__ == Problem.__name__
