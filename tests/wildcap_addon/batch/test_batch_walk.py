# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The walk through the masks of a batch that is opened in Blender, and what is refused or has gone wrong with one."""

import json
import os
import socket
import time

import pytest

from core.batch import gate, state
from core.settings.settings import from_json, preset
from tests.fixtures import batch_faces
from tests.fixtures.drawn import buttons, drawn
from tests.wildcap_addon.test_refusals import refuses

bpy = pytest.importorskip("bpy")


def test_the_walk_goes_through_the_masks_that_wait(addon, batches, tmp_path):
    chosen = from_json({"seed": 3, "solve": {"skin_tone": "0.5,0.25,0.125"}}, preset("draft"))
    folder, session = tmp_path / "a batch é", addon("paint.session")
    faces = [batch_faces.up_to_mask(folder, name, chosen) for name in ("anna", "bert", "carl")]
    batch_faces.planned(folder, *faces, settings={"seed": 3, "solve": {"skin_tone": "0.5,0.25,0.125"}})
    gate.accept_mask(faces[1])
    bpy.ops.wildcap.open_batch(directory=str(folder))
    items = bpy.context.scene.wildcap.captures
    assert [item.name for item in items] == ["anna", "bert", "carl"]
    assert (
        addon("properties").settings(items[0]).seed == 3
        and items[0].quality == "draft"
        and tuple(items[0].skin_tone) == (0.5, 0.25, 0.125)
    )
    assert addon("properties").job_settings(items[0])["solve"]["skin_tone"] == "0.5,0.25,0.125", (
        "or what the batch has solved would be out of date here"
    )
    items[2].skin_tone[0] = 0.6
    assert addon("properties").job_settings(items[2])["solve"]["skin_tone"] == "0.6000,0.2500,0.1250"
    batch_faces.wait(addon, lambda: batch_faces.seen(batches))
    assert [face.name for face in batches.waiting()] == ["anna", "carl"] and batches.view().count(state.TO_DO) == 1
    assert ("Masks waiting: 2, to do: 1", False) in drawn(addon("batch.panel").WILDCAP_PT_batch)
    bpy.ops.wildcap.next_mask()
    assert (
        session.root() == str(faces[0].root)
        and bpy.context.mode == 'PAINT_TEXTURE'
        and bpy.context.object.name == "anna"
    )
    image = session.mask()
    painted = addon("paint.mask_image").mask_values(image).copy()
    painted[10:20, 30:40] = 1
    addon("paint.mask_image").set_values(image, painted)
    bpy.ops.wildcap.accept_mask()
    assert faces[0].shadow_mask.read_bytes() == addon("paint.mask_image").grey_png(painted) and gate.is_accepted(
        faces[0]
    )
    assert (
        session.root() == str(faces[2].root)
        and bpy.data.objects["anna"].hide_get()
        and not bpy.data.objects["carl"].hide_get()
    )
    refuses("No other mask waits", bpy.ops.wildcap.next_mask)
    bpy.ops.wildcap.finish_mask()
    bpy.context.scene.wildcap.active_index = 0
    assert not bpy.data.objects["anna"].hide_get(), "the row that is clicked shows its head again"
    refuses("does not wait: click Next Mask", bpy.ops.wildcap.accept_mask)
    bpy.ops.wildcap.next_mask()
    assert session.root() == str(faces[2].root)
    bpy.ops.wildcap.accept_mask()
    assert not session.active() and bpy.context.mode == 'OBJECT'
    batch_faces.wait(addon, lambda: batches.ready() == 3 and not batches._accepted)
    assert "wildcap.solve_all" in buttons(addon("batch.panel").WILDCAP_PT_batch)
    bpy.ops.wildcap.solve_all()
    assert batches.current() == folder and len(list(folder.glob("batches"))) == 0
    batch_faces.ended(addon, done=3)
    seeds = {face.root.name: face.read()["stages"]["solve"]["seed"] for face in faces}
    assert seeds == dict.fromkeys(("anna.wildcap", "bert.wildcap", "carl.wildcap"), 3)
    icons = [batches.ICONS[batches.state_of(str(face.root)).state] for face in faces]
    assert icons == ['CHECKMARK'] * 3


def test_the_walk_from_another_mode_and_over_a_face_that_is_damaged(addon, batches, tmp_path):
    folder = tmp_path / "batch"
    anna, bert = (batch_faces.up_to_mask(folder, name, preset("draft")) for name in ("anna", "bert"))
    batch_faces.planned(folder, anna, bert)
    bpy.ops.wildcap.open_batch(directory=str(folder))
    batch_faces.wait(addon, lambda: len(batches.waiting()) == 2)
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode='EDIT')
    refuses("while you paint a mask", bpy.ops.wildcap.next_mask)
    bpy.ops.object.mode_set(mode='OBJECT')
    anna.head.write_text("v 0 0 0\n")
    refuses("not one mesh with UVs", bpy.ops.wildcap.next_mask)
    batch_faces.wait(
        addon, lambda: [face.name for face in batches.waiting()] == ["bert"] or len(batches.waiting()) == 2
    )
    bpy.ops.wildcap.next_mask()
    assert addon("paint.session").root() == str(bert.root)
    bert.shadow_mask_auto.unlink()
    refuses("no proposed shadow mask to accept", bpy.ops.wildcap.accept_mask)


def test_what_is_no_batch_is_refused_and_one_that_is_damaged_meanwhile_says_so(addon, batches, tmp_path):
    refuses("There is no batch at", bpy.ops.wildcap.open_batch, directory=str(tmp_path))
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "batch.json").write_text('{"faces": 3}')
    refuses("is not a batch record", bpy.ops.wildcap.open_batch, directory=str(tmp_path / "bad"))
    (tmp_path / "bad" / "batch.json").write_text('{"format": 99}')
    refuses("newer version of WildCap", bpy.ops.wildcap.open_batch, directory=str(tmp_path / "bad"))
    assert batches.current() is None
    for click in ("close_batch", "next_mask", "accept_mask"):
        refuses("No batch is open: click Open Batch", getattr(bpy.ops.wildcap, click))
    refuses("fewer than two captures", bpy.ops.wildcap.solve_all)
    folder = batch_faces.planned(tmp_path / "good", batch_faces.filmed(tmp_path / "good", "anna"))
    bpy.ops.wildcap.open_batch(directory=str(folder))
    batch_faces.wait(addon, lambda: batch_faces.seen(batches))
    (folder / "batch.json").write_text("{")
    batch_faces.wait(addon, lambda: batches.view().problem is not None)
    texts = " ".join(text for text, _ in drawn(addon("batch.panel").WILDCAP_PT_batch))
    # a long path is broken anywhere
    assert "batch.json cannot be read".replace(" ", "") in texts.replace(" ", "") and "Masks" not in texts
    refuses("batch.json cannot be read", bpy.ops.wildcap.solve_all)


def test_what_a_machine_that_has_gone_left_is_no_obstacle(addon, batches, tmp_path):
    """The locks of a batch and of a face, by another machine: they hold while they are refreshed, and a term longer."""
    capture = batch_faces.up_to_mask(tmp_path / "batch", "anna", from_json({}, preset("draft")))
    folder = batch_faces.planned(tmp_path / "batch", capture)
    locks = folder / "lock", capture.lock
    for path in locks:
        path.write_text(json.dumps({"host": "elsewhere/1/2", "pid": 1, "since": "2026-11-24T00:00:00", "token": "x"}))
    bpy.ops.wildcap.open_batch(directory=str(folder))
    batch_faces.wait(addon, lambda: batches.view().runner == "elsewhere" and batches.view().count(state.WORKING) == 1)
    refuses("A batch is running", bpy.ops.wildcap.solve_all)
    refuses("by a batch or another Blender", bpy.ops.wildcap.reconstruct)
    for path in locks:
        os.utime(path, (0, time.time() - 60))
    batch_faces.wait(addon, lambda: batches.view().count(state.WAITING) == 1, limit_s=15)
    assert not batches.view().runner and bpy.ops.wildcap.reconstruct.poll() and bpy.ops.wildcap.accept_mask.poll()
    assert bpy.ops.wildcap.solve_all.poll()
    assert "wildcap.cancel_batch" not in buttons(addon("batch.panel").WILDCAP_PT_batch)


def test_a_folder_that_goes_away_while_it_is_looked_at(addon, batches, monkeypatch, tmp_path):
    folder = batch_faces.planned(tmp_path / "batch", batch_faces.filmed(tmp_path / "batch", "anna"))
    monkeypatch.setattr(
        addon("batch_watch").state, "derive_state", lambda *_: (_ for _ in ()).throw(OSError(5, "Input/output error"))
    )
    bpy.ops.wildcap.open_batch(directory=str(folder))
    batch_faces.wait(addon, lambda: batches.view().count(state.STOPPED) == 1)
    assert "anna.wildcap cannot be read (Input/output error)" in batches.view().states["anna"].problem
    monkeypatch.setattr(addon("batch_watch").state, "derive_state", lambda *_: 1 / 0)
    batch_faces.wait(addon, lambda: batches.view().problem is not None)
    assert "ZeroDivisionError" in str(batches.view().problem)
    monkeypatch.undo()
    batch_faces.wait(addon, lambda: batches.view().count(state.TO_DO) == 1)
    (folder / "lock").write_text(json.dumps({"host": f"{socket.gethostname()}", "pid": os.getpid(), "since": "now"}))
    (folder / "progress.json").write_text('{"ended": 1, "of": 2, "left_s": "soon", "working": {}}')
    batch_faces.wait(addon, lambda: batches.view().runner == socket.gethostname())
    assert batches.view().progress == {}, "a figure that makes no sense is none"
    (folder / "progress.json").write_text(
        '{"ended": 1, "of": 4, "left_s": 1230.0, "working": {"anna": {"stage": "Cameras", "share": 0.4, "eta_s": 1}}}'
    )
    batch_faces.wait(addon, lambda: bool(batches.view().progress))
    assert (
        batches.line(batches.view()) == "anna: Cameras 40%, about 20 min left" and batches.share(batches.view()) == 0.25
    )
    monkeypatch.setattr(addon("batch_watch").lease, "TERM_S", 0.1)
    batch_faces.wait(addon, lambda: not batches.view().runner)  # it was not refreshed for a term
    (folder / "lock").unlink()
