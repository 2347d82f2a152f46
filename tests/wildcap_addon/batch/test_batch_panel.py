# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All faces reconstructed or solved from Blender, by a batch that outlives it and is found again. The batch and its
workers are real processes, their rooms are tiny; timers do not fire in the wheel, so the tests poll."""

import json
import os
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import pytest

from core.batch import gate, record, state, task
from core.capture.capture import Capture
from tests.fixtures import batch_faces, standin
from tests.fixtures.batch_faces import filmed
from tests.fixtures.drawn import drawn
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def open_captures(*captures: Capture) -> None:
    for capture in captures:
        bpy.ops.wildcap.open_capture(directory=str(capture.root))


def test_a_batch_goes_on_without_blender_is_found_again_and_stops_within_two_seconds(addon, batches, wildcap, tmp_path):
    import addon_utils

    click, films = bpy.ops.wildcap, tmp_path / "films"
    first, second = filmed(films, "anna", {"cameras": "slow"}), filmed(films, "bert")
    open_captures(first, second)
    bpy.context.scene.wildcap.captures[1].seed = 7
    click.reconstruct_all()
    folder = batches.current()
    assert folder.parent == tmp_path / "captures" / "batches"
    batch = record.read_batch(folder)
    assert batch.gate == "artist" and [(f.name, f.root) for f in batch.faces] == [
        ("anna", first.root),
        ("bert", second.root),
    ]
    assert batch.faces[1].chosen().seed == 7 and batch.faces[0].source == first.source
    bpy.context.scene.wildcap.active_index = 0
    batch_faces.wait(addon, lambda: batches.line(batches.view()).startswith("anna: Cameras"))
    assert batches.works_on(str(first.root)) and not batches.works_on(str(second.root))
    assert ("0 of 2 faces", False) in drawn(addon("batch.panel").WILDCAP_PT_batch)
    refuses("by a batch or another Blender", click.reconstruct)
    step = addon("next_step").next_step(addon("panel").gather(bpy.context, bpy.context.scene.wildcap.captures[0]))
    assert step.operator == "wildcap.cancel_batch"
    for name in ("reconstruct_all", "solve_all", "close_batch"):
        refuses("A batch is running", getattr(click, name))
    bpy.context.scene.wildcap.active_index = 1
    assert click.reconstruct.poll(), "one that waits in line may be worked on by hand"
    refuses("batch that is running", click.delete_face)
    pid = json.loads((folder / "lock").read_text())["pid"]
    if os.name == "posix":
        assert os.getpriority(os.PRIO_PROCESS, pid) >= 10 and os.getsid(pid) == pid != os.getpid()
    kept = addon("preferences").get().captures
    addon_utils.disable(wildcap, default_set=True)
    addon_utils.enable(wildcap, default_set=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert batch_faces.alive(pid) and batches.current() is None
    preferences = addon("preferences").get()
    preferences.python, preferences.captures = sys.executable, kept
    batch_faces.wait(addon, lambda: batches.current() == folder and "anna" in batches.line(batches.view()))
    began = time.monotonic()
    click.cancel_batch()
    batch_faces.wait(addon, lambda: not addon("batch.running").running() and not (folder / "lock").exists())
    assert time.monotonic() - began < 2.5
    assert first.read()["stages"].keys() == {"frames"} and not second.read()["stages"]
    refuses("No batch is running", click.cancel_batch)
    other = batch_faces.planned(tmp_path / "other", filmed(tmp_path / "other", "cleo"))
    click.open_batch(directory=str(other))
    assert batches.current() == other
    click.close_batch()
    open_captures(first)
    batch_faces.wait(addon, lambda: batches.current() == folder)  # by the capture that it shares with this scene


def test_reconstruct_all_stops_at_the_masks_and_solve_all_takes_them_as_they_are(addon, batches, tmp_path):
    click, panel = bpy.ops.wildcap, addon("batch.panel").WILDCAP_PT_batch
    anna, bert = (filmed(tmp_path / "films", name) for name in ("anna", "bert"))
    open_captures(anna, bert)
    refuses("no face has a shadow mask", click.solve_all)
    click.reconstruct_all()
    folder = batches.current()
    batch_faces.ended(addon, waiting=2)
    assert [face.name for face in batches.waiting()] == ["anna", "bert"] and not (anna.maps / "normal.png").exists()
    (bert.root / "mood.json").write_text(json.dumps({"solve": "finding"}))
    click.solve_all()
    assert batches.current() == folder, "the same captures are the same batch"
    assert gate.is_accepted(anna) and not batches.waiting()
    batch_faces.ended(addon, done=1, stopped=1)
    assert (anna.maps_4k / "normal.png").is_file()
    stopped = batches.state_of(str(bert.root))
    assert stopped.state == state.STOPPED and stopped.problem == "The face is not there."
    bpy.context.scene.wildcap.active_index = 1
    assert {("The face is not there.", False), ("Done: 1, stopped: 1", False)} <= set(drawn(panel))
    (bert.root / "mood.json").write_text("{}")
    click.solve_all()  # tries again what has stopped
    batch_faces.ended(addon, done=2)
    assert addon("problems").of("") is None


def test_the_batch_of_the_list_has_faces_of_names_of_their_own_and_leaves_out_those_without_a_video(
    addon, batches, tmp_path
):
    planning = addon("batch.planning")
    first, second = (filmed(tmp_path / folder, "-anna") for folder in ("a", "b"))
    damaged = Capture(standin.make(tmp_path / "damaged.wildcap", solved=False))
    open_captures(first, second, damaged)
    damaged.json.write_text("{")
    batch, left_out = planning.prepare(bpy.context)
    assert [face.name for face in batch.faces] == ["anna", "anna_2"] and left_out == ["damaged"]
    open_captures(filmed(tmp_path / "c", "carl"))
    other, _ = planning.prepare(bpy.context)
    assert other.root != batch.root and len(other.faces) == 3, "other captures are another batch"
    bpy.context.scene.wildcap.captures.clear()
    batches.close()
    refuses("has a video", planning.prepare, bpy.context)
    folders = [planning._make_folder(batch.root.parent) for _ in range(2)]
    assert folders[0] != folders[1], "never one that is there"
    (tmp_path / "captures" / "file").write_text("")
    refuses("could not be written", planning._make_folder, tmp_path / "captures" / "file")


def test_a_result_comes_in_when_the_batch_lets_go_of_the_face(addon, batches, monkeypatch, tmp_path):
    capture, running, came, at_work = filmed(tmp_path / "films", "anna"), addon("batch.running"), [], [True, False]
    open_captures(capture)
    monkeypatch.setattr(addon("incoming"), "bring_in", came.append)
    monkeypatch.setattr(batches, "works_on", lambda root: at_work.pop(0))
    running._tick()
    assert not came
    running._tick()
    assert came == [{str(capture.root): "reconstruct"}]


def test_why_a_batch_cannot_be_started(addon, batches, monkeypatch, tmp_path):
    running, jobs, preferences = addon("batch.running"), addon("jobs"), addon("preferences").get()
    reconstruct_all = bpy.ops.wildcap.reconstruct_all
    anna, bert = (filmed(tmp_path / "films", name) for name in ("anna", "bert"))
    open_captures(anna, bert)
    jobs._jobs[str(anna.root)] = jobs.Job('solve', Mock())
    refuses("A job is running", reconstruct_all)
    jobs._jobs.clear()
    preferences.python = ""
    refuses("solver is not set up", reconstruct_all)
    assert not (tmp_path / "captures").exists(), "nothing is written before"
    preferences.python = str(tmp_path / "films" / "anna.mp4")
    refuses("Python .* could not be started", reconstruct_all)
    preferences.python = sys.executable
    folder = batches.current()
    (folder / "run.log").unlink()
    (folder / "run.log").mkdir()
    refuses("could not be written", reconstruct_all)
    (folder / "run.log").rmdir()
    other = batch_faces.planned(tmp_path / "b", filmed(tmp_path / "b", "c"))
    monkeypatch.setattr(running, "_process", Mock(poll=lambda: None))
    refuses("A batch is running", bpy.ops.wildcap.open_batch, directory=str(other))
    monkeypatch.setattr(running, "ask_to_stop", Mock(side_effect=OSError(30, "Read-only file system")))
    refuses("read-only", bpy.ops.wildcap.cancel_batch)
    monkeypatch.setattr(running, "_stopping", False)
    monkeypatch.setattr(running, "_process", None)


@pytest.mark.parametrize(
    ("code", "log", "words"),
    [
        (0, "2 faces: all are done\n", None),
        (2, "anna: done\nThe lock is strange.\nRemove it.\n", "The lock is strange."),
        (-9, "anna: Cameras\n", "ended unexpectedly"),
        (1, None, "ended unexpectedly"),
    ],
)
def test_how_a_run_ended_is_told_by_its_last_lines(addon, batches, monkeypatch, tmp_path, code, log, words):
    running = addon("batch.running")
    if log is not None:
        (tmp_path / "run.log").write_text(log, encoding="utf-8")
    monkeypatch.setattr(running, "_batch", record.Batch(tmp_path, ()))
    monkeypatch.setattr(running, "_process", Mock(poll=lambda: code, returncode=code))
    running.poll()
    problem = addon("problems").of("")
    assert problem is None if words is None else words in problem.problem and problem.remedy


def test_the_key_of_a_paid_service_goes_to_those_alone_who_need_it(addon, batches, monkeypatch, tmp_path):
    monkeypatch.setenv("WILDCAP_SWITCHLIGHT_KEY", "secret")
    capture = filmed(tmp_path / "films", "anna")
    for delighter, key in (("network", None), ("switchlight", "secret")):
        face = record.BatchFace("anna", capture.source, capture.root, "draft", {"delight": {"delighter": delighter}})
        environment = addon("batch.running")._environment(record.Batch(Path(tmp_path), (face,)))
        job = task.write_job(capture, settings=face.settings)
        assert [each.get("WILDCAP_SWITCHLIGHT_KEY") for each in (environment, task._paid_key(job))] == [key, key]
