# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The walk through the masks of a batch that is opened in Blender, and what is refused or has gone wrong with one."""

import json
import os
import socket
import time
from unittest.mock import Mock

import pytest

from core.batch import gate, state
from core.settings.settings import from_json, preset
from tests.fixtures import batch_faces
from tests.fixtures.batch_faces import filmed, planned, up_to_mask, wait
from tests.fixtures.drawn import buttons, drawn
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def names(faces) -> list[str]:
    return [face.name for face in faces]


def test_the_walk_goes_through_the_masks_that_wait(addon, batches, monkeypatch, tmp_path):
    settings = {"seed": 3, "solve": {"skin_tone": "0.5,0.25,0.125"}}
    folder, session, mask_image = tmp_path / "a batch é", addon("paint.session"), addon("paint.mask_image")
    click, panel, properties = bpy.ops.wildcap, addon("batch.panel").WILDCAP_PT_batch, addon("properties")
    faces = [up_to_mask(folder, name, from_json(settings, preset("draft"))) for name in ("anna", "bert", "carl")]
    planned(folder, *faces, settings=settings)
    gate.accept_mask(faces[1])
    click.open_batch(directory=str(folder))
    items = bpy.context.scene.wildcap.captures
    assert names(items) == ["anna", "bert", "carl"]
    assert properties.settings(items[0]).seed == 3 and items[0].quality == "draft"
    assert tuple(items[0].skin_tone) == (0.5, 0.25, 0.125)
    tones = [properties.job_settings(items[0])["solve"]["skin_tone"]]
    items[2].skin_tone[0] = 0.6
    tones.append(properties.job_settings(items[2])["solve"]["skin_tone"])
    assert tones == ["0.5,0.25,0.125", "0.6000,0.2500,0.1250"], "or what was solved would be out of date here"
    wait(addon, lambda: batch_faces.seen(batches))
    assert names(batches.waiting()) == ["anna", "carl"] and batches.view().count(state.TO_DO) == 1
    assert ("Masks waiting: 2, to do: 1", False) in drawn(panel) and "wildcap.accept_mask" in buttons(panel)
    click.next_mask()
    assert session.root() == str(faces[0].root)
    assert bpy.context.mode == 'PAINT_TEXTURE' and bpy.context.object.name == "anna"
    painted = mask_image.mask_values(session.mask()).copy()
    painted[10:20, 30:40] = 1
    mask_image.set_values(session.mask(), painted)
    click.accept_mask()
    assert faces[0].shadow_mask.read_bytes() == mask_image.grey_png(painted) and gate.is_accepted(faces[0])
    assert session.root() == str(faces[2].root)
    assert [bpy.data.objects[name].hide_get() for name in ("anna", "carl")] == [True, False]
    refuses("No other mask waits", click.next_mask)
    click.finish_mask()
    bpy.context.scene.wildcap.active_index = 0
    assert not bpy.data.objects["anna"].hide_get(), "the row that is clicked shows its head again"
    refuses("does not wait", click.accept_mask)
    click.next_mask()
    assert session.root() == str(faces[2].root)
    click.accept_mask()
    assert not session.active() and bpy.context.mode == 'OBJECT'
    wait(addon, lambda: batches.ready() == 3 and not batches._accepted)
    assert "wildcap.solve_all" in buttons(panel)
    monkeypatch.setattr(addon("batch.running"), "start", started := Mock())
    click.solve_all()
    assert started.call_args.args[1:] == ("retry", str(folder)) and batches.current() == folder


def test_the_walk_from_another_mode_and_over_a_face_that_is_damaged(addon, batches, tmp_path):
    folder, next_mask = tmp_path / "batch", bpy.ops.wildcap.next_mask
    anna, bert = (up_to_mask(folder, name, preset("draft")) for name in ("anna", "bert"))
    planned(folder, anna, bert)
    bpy.ops.wildcap.open_batch(directory=str(folder))
    wait(addon, lambda: len(batches.waiting()) == 2)
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode='EDIT')
    refuses("while you paint a mask", next_mask)
    bpy.ops.object.mode_set(mode='OBJECT')
    anna.head.write_text("v 0 0 0\n")
    refuses("one mesh with UVs", next_mask)
    wait(addon, lambda: names(batches.waiting()) == ["bert"] or len(batches.waiting()) == 2)
    next_mask()
    assert addon("paint.session").root() == str(bert.root)
    bert.shadow_mask_auto.unlink()
    refuses("no proposed shadow mask", bpy.ops.wildcap.accept_mask)


def test_what_is_no_batch_is_refused_and_one_that_is_damaged_meanwhile_says_so(addon, batches, tmp_path):
    click, bad = bpy.ops.wildcap, tmp_path / "bad"
    refuses("There is no batch", click.open_batch, directory=str(tmp_path))
    bad.mkdir()
    (bad / "batch.json").write_text('{"format": 99}')
    refuses("newer version", click.open_batch, directory=str(bad))
    assert batches.current() is None
    for name in ("close_batch", "next_mask", "accept_mask"):
        refuses("No batch is open", getattr(click, name))
    refuses("fewer than two", click.solve_all)
    folder = planned(tmp_path / "good", filmed(tmp_path / "good", "anna"))
    click.open_batch(directory=str(folder))
    wait(addon, lambda: batch_faces.seen(batches))
    (folder / "batch.json").write_text("{")
    wait(addon, lambda: batches.view().problem is not None)
    texts = "".join(text for text, _ in drawn(addon("batch.panel").WILDCAP_PT_batch)).replace(" ", "")
    assert "batch.jsoncannotberead" in texts and "Masks" not in texts  # a long path is broken anywhere
    refuses("batch.json cannot be read", click.solve_all)


def test_what_a_machine_that_has_gone_left_is_no_obstacle(addon, batches, monkeypatch, tmp_path):
    """The locks of a batch and of a face, by another machine: they hold while they are refreshed, and a term longer."""
    monkeypatch.setattr(addon("batch_watch"), "LONGEST_REST_S", 0.2)
    capture, click = up_to_mask(tmp_path / "batch", "anna", preset("draft")), bpy.ops.wildcap
    folder = planned(tmp_path / "batch", capture)
    locks = folder / "lock", capture.lock
    for path in locks:
        path.write_text(json.dumps({"host": "elsewhere/1/2", "pid": 1, "since": "2026-11-24T00:00:00", "token": "x"}))
    click.open_batch(directory=str(folder))
    wait(addon, lambda: batches.view().runner == "elsewhere" and batches.view().count(state.WORKING) == 1)
    refuses("A batch is running", click.solve_all)
    refuses("by a batch or another Blender", click.reconstruct)
    for path in locks:
        os.utime(path, (0, time.time() - 60))
    wait(addon, lambda: batches.view().count(state.WAITING) == 1, limit_s=15)
    assert not batches.view().runner
    assert click.reconstruct.poll() and click.accept_mask.poll() and click.solve_all.poll()
    assert "wildcap.cancel_batch" not in buttons(addon("batch.panel").WILDCAP_PT_batch)


def test_a_folder_that_goes_away_while_it_is_looked_at(addon, batches, monkeypatch, tmp_path):
    folder, watch = planned(tmp_path / "batch", filmed(tmp_path / "batch", "anna")), addon("batch_watch")
    with monkeypatch.context() as patched:
        patched.setattr(watch.state, "derive_state", Mock(side_effect=OSError(5, "Input/output error")))
        bpy.ops.wildcap.open_batch(directory=str(folder))
        wait(addon, lambda: batches.view().count(state.STOPPED) == 1)
        assert "anna.wildcap cannot be read (Input/output error)" in batches.view().states["anna"].problem
        patched.setattr(watch.state, "derive_state", lambda *_: 1 / 0)
        wait(addon, lambda: batches.view().problem is not None)
        assert "ZeroDivisionError" in str(batches.view().problem)
    wait(addon, lambda: batches.view().count(state.TO_DO) == 1)


def test_the_progress_of_a_run_is_told_as_far_as_it_makes_sense(addon, batches, monkeypatch, tmp_path):
    folder = planned(tmp_path / "batch", filmed(tmp_path / "batch", "anna"))
    progress = {"ended": 1, "of": 4, "working": {"anna": {"stage": "Cameras", "share": 0.4, "eta_s": 1}}}
    (folder / "lock").write_text(json.dumps({"host": socket.gethostname(), "pid": os.getpid(), "since": "now"}))
    (folder / "progress.json").write_text(json.dumps({**progress, "left_s": "soon"}))
    bpy.ops.wildcap.open_batch(directory=str(folder))
    wait(addon, lambda: batches.view().runner == socket.gethostname())
    assert batches.view().progress == {}
    (folder / "progress.json").write_text(json.dumps({**progress, "left_s": 1230.0}))
    wait(addon, lambda: bool(batches.view().progress))
    assert batches.line(batches.view()) == "anna: Cameras 40%, about 20 min left"
    assert batches.share(batches.view()) == 0.25
    monkeypatch.setattr(addon("batch_watch").lease, "TERM_S", 0.1)
    wait(addon, lambda: not batches.view().runner)  # it was not refreshed for a term
    (folder / "lock").unlink()
