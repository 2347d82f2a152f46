# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All faces reconstructed or solved from Blender, by a batch that outlives it and is found again. The batch and its
workers are real processes, their rooms are tiny; timers do not fire in the wheel, so the tests poll."""

import json
import os
import sys
import time
from pathlib import Path

import pytest

from core.batch import gate, record, state
from core.capture.capture import Capture
from tests.fixtures import batch_faces, standin
from tests.fixtures.drawn import drawn
from tests.wildcap_addon.test_refusals import refuses

bpy = pytest.importorskip("bpy")


def open_captures(*captures: Capture) -> None:
    for capture in captures:
        bpy.ops.wildcap.open_capture(directory=str(capture.root))


def test_a_batch_goes_on_without_blender_is_found_again_and_stops_within_two_seconds(addon, batches, wildcap, tmp_path):
    import addon_utils

    first, second = (
        batch_faces.filmed(tmp_path / "films", name, {"cameras": "slow"} if name == "anna" else None)
        for name in ("anna", "bert")
    )
    open_captures(first, second)
    settings = bpy.context.scene.wildcap.captures[1]
    settings.seed = 7
    bpy.ops.wildcap.reconstruct_all()
    folder = batches.current()
    assert folder.parent == tmp_path / "captures" / "batches"
    asked = record.read_batch(folder)
    assert asked.gate == "artist"
    assert [(face.name, face.root) for face in asked.faces] == [("anna", first.root), ("bert", second.root)]
    assert asked.faces[1].chosen().seed == 7 and asked.faces[0].source == first.source
    bpy.context.scene.wildcap.active_index = 0
    batch_faces.wait(addon, lambda: batches.line(batches.view()).startswith("anna: Cameras"))
    assert batches.works_on(str(first.root)) and not batches.works_on(str(second.root))
    assert ("0 of 2 faces", False) in drawn(addon("batch.panel").WILDCAP_PT_batch)
    refuses("by a batch or another Blender", bpy.ops.wildcap.reconstruct)
    step = addon("next_step").next_step(addon("panel").gather(bpy.context, bpy.context.scene.wildcap.captures[0]))
    assert step.operator == "wildcap.cancel_batch"
    for click in ("reconstruct_all", "solve_all", "close_batch"):
        refuses("A batch is running", getattr(bpy.ops.wildcap, click))
    bpy.context.scene.wildcap.active_index = 1
    assert bpy.ops.wildcap.reconstruct.poll(), "one that waits in line may be worked on by hand"
    refuses("one of a batch that is running", bpy.ops.wildcap.delete_face)
    pid = json.loads((folder / "lock").read_text())["pid"]
    assert pid != os.getpid()
    if os.name == "posix":
        assert os.getpriority(os.PRIO_PROCESS, pid) >= 10 and os.getsid(pid) == pid
    preferences = addon("preferences").get()
    kept = preferences.captures
    addon_utils.disable(wildcap, default_set=True)
    addon_utils.enable(wildcap, default_set=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert batch_faces.alive(pid) and addon("batches").current() is None
    preferences = addon("preferences").get()
    preferences.python, preferences.captures = sys.executable, kept
    batch_faces.wait(addon, lambda: addon("batches").current() == folder and "anna" in batches.line(batches.view()))
    other = batch_faces.planned(tmp_path / "other", batch_faces.filmed(tmp_path / "other", "cleo"))
    began = time.monotonic()
    bpy.ops.wildcap.cancel_batch()
    batch_faces.wait(addon, lambda: not addon("batch.running").running() and not (folder / "lock").exists())
    assert time.monotonic() - began < 2.5
    assert first.read()["stages"].keys() == {"frames"} and not second.read()["stages"]
    refuses("No batch is running", bpy.ops.wildcap.cancel_batch)
    bpy.ops.wildcap.open_batch(directory=str(other))
    assert batches.current() == other
    bpy.ops.wildcap.close_batch()
    bpy.ops.wildcap.open_capture(directory=str(first.root))
    batch_faces.wait(addon, lambda: batches.current() == folder)  # by the capture that it shares with this scene


def test_reconstruct_all_stops_at_the_masks_and_solve_all_takes_them_as_they_are(addon, batches, tmp_path):
    anna, bert = (batch_faces.filmed(tmp_path / "films", name) for name in ("anna", "bert"))
    stray = standin.make(tmp_path / "films" / "stray.wildcap", solved=False)
    open_captures(anna, bert)
    bpy.ops.wildcap.open_capture(directory=str(stray))
    refuses("nothing to solve: no face has a shadow mask", bpy.ops.wildcap.solve_all)
    bpy.ops.wildcap.reconstruct_all()
    folder = batches.current()
    batch_faces.ended(addon, waiting=2)
    assert [face.name for face in batches.waiting()] == ["anna", "bert"] and not (anna.maps / "normal.png").exists()
    (bert.root / "mood.json").write_text(json.dumps({"solve": "finding"}))
    bpy.ops.wildcap.solve_all()
    assert batches.current() == folder, "the same captures are the same batch"
    assert gate.is_accepted(anna) and not batches.waiting()
    batch_faces.ended(addon, done=1, stopped=1)
    assert (anna.maps_4k / "normal.png").is_file()
    stopped = batches.state_of(str(bert.root))
    assert stopped.state == state.STOPPED and stopped.problem == "The face is not there."
    bpy.context.scene.wildcap.active_index = 1
    assert ("The face is not there.", False) in drawn(addon("batch.panel").WILDCAP_PT_batch)
    assert ("Done: 1, stopped: 1", False) in drawn(addon("batch.panel").WILDCAP_PT_batch)
    (bert.root / "mood.json").write_text("{}")
    bpy.ops.wildcap.solve_all()  # tries again what has stopped
    batch_faces.ended(addon, done=2)
    assert addon("problems").of("") is None
    carl = batch_faces.filmed(tmp_path / "films", "carl")
    open_captures(carl)
    bpy.ops.wildcap.reconstruct_all()
    assert batches.current() != folder and len(record.read_batch(batches.current()).faces) == 3, (
        "other captures are another batch"
    )


def test_two_faces_of_one_name_and_a_face_without_a_video(addon, batches, tmp_path):
    first, second = (batch_faces.filmed(tmp_path / folder, "-anna") for folder in ("a", "b"))
    open_captures(first, second)
    damaged = standin.make(tmp_path / "damaged.wildcap", solved=False)
    bpy.ops.wildcap.open_capture(directory=str(damaged))
    (damaged / "capture.json").write_text("{")
    batch, left_out = addon("batch.planning").prepare(bpy.context)
    assert [face.name for face in batch.faces] == ["anna", "anna_2"] and left_out == ["damaged"]
    for _ in range(2):
        bpy.context.scene.wildcap.captures.remove(0)
    batches.close()
    refuses("No capture of the list has a video", addon("batch.planning").prepare, bpy.context)
    open_captures(first)
    assert addon("batch.planning")._make_folder(batch.root.parent) != addon("batch.planning")._make_folder(
        batch.root.parent
    ), "never one that is there"
    (tmp_path / "captures" / "file").write_text("")
    refuses("could not be written", addon("batch.planning")._make_folder, tmp_path / "captures" / "file")


def test_a_result_comes_in_when_the_batch_lets_go_of_the_face(addon, batches, monkeypatch, tmp_path):
    capture = batch_faces.filmed(tmp_path / "films", "anna", {"cameras": "slow"})
    open_captures(batch_faces.filmed(tmp_path / "films", "bert"), capture)
    came = []
    monkeypatch.setattr(addon("incoming"), "bring_in", came.append)
    bpy.ops.wildcap.reconstruct_all()
    batch_faces.wait(addon, lambda: batches.works_on(str(capture.root)))
    assert not came
    # read once, by each stage that begins: the one that is slow is cancelled
    (capture.root / "mood.json").write_text("{}")
    bpy.ops.wildcap.cancel_batch()
    batch_faces.wait(addon, lambda: not batches.works_on(str(capture.root)))
    assert came == [{str(capture.root): "reconstruct"}]


def test_why_a_batch_cannot_be_started(addon, batches, monkeypatch, tmp_path):
    running, jobs = addon("batch.running"), addon("jobs")
    anna, bert = (batch_faces.filmed(tmp_path / "films", name) for name in ("anna", "bert"))
    open_captures(anna, bert)
    jobs._jobs[str(anna.root)] = jobs.Job('solve', addon("asking").BackgroundTask("solve", lambda task: None))
    refuses("A job is running", bpy.ops.wildcap.reconstruct_all)
    jobs._jobs.clear()
    preferences = addon("preferences").get()
    preferences.python = ""
    refuses("solver is not set up", bpy.ops.wildcap.reconstruct_all)
    assert not (tmp_path / "captures").exists(), "nothing is written before"
    preferences.python = str(tmp_path / "films" / "anna.mp4")
    refuses("Python .* could not be started", bpy.ops.wildcap.reconstruct_all)
    preferences.python = sys.executable
    folder = batches.current()
    (folder / "run.log").unlink()
    (folder / "run.log").mkdir()
    refuses("could not be written", bpy.ops.wildcap.reconstruct_all)
    (folder / "run.log").rmdir()
    (folder / "lock").mkdir()  # the batch itself finds what is in its way
    bpy.ops.wildcap.reconstruct_all()
    other = batch_faces.planned(tmp_path / "b", batch_faces.filmed(tmp_path / "b", "c"))
    refuses("before you open another one", bpy.ops.wildcap.open_batch, directory=str(other))
    batch_faces.wait(addon, lambda: not running.running())
    assert "is not one of WildCap's locks" in addon("problems").of("").problem
    (folder / "lock").rmdir()
    (anna.root / "mood.json").write_text(json.dumps({"cameras": "slow"}))
    bpy.ops.wildcap.reconstruct_all()
    batch_faces.wait(addon, lambda: "anna" in batches.line(batches.view()))
    os.kill(json.loads((folder / "lock").read_text())["pid"], 9)
    batch_faces.wait(addon, lambda: not running.running())
    assert "ended unexpectedly (exit code" in addon("problems").of("").problem
    (folder / "stop").mkdir()
    monkeypatch.setattr(running, "running", lambda: True)
    monkeypatch.setattr(Path, "touch", lambda self: (_ for _ in ()).throw(OSError(30, "Read-only file system")))
    refuses("read-only", bpy.ops.wildcap.cancel_batch)
    monkeypatch.undo()
    (folder / "stop").rmdir()
    running._stopping = False


def test_the_key_of_a_paid_service_goes_to_those_alone_who_need_it(addon, batches, monkeypatch, tmp_path):
    from core.batch import task

    monkeypatch.setenv("WILDCAP_SWITCHLIGHT_KEY", "secret")
    capture = batch_faces.filmed(tmp_path / "films", "anna")
    environment = addon("batch.running")._environment
    keys = []
    for delighter in ("network", "switchlight"):
        face = record.BatchFace("anna", capture.source, capture.root, "draft", {"delight": {"delighter": delighter}})
        keys.append(environment(record.Batch(tmp_path, (face,))).get("WILDCAP_SWITCHLIGHT_KEY"))
        job = task.write_job(capture, settings=face.settings)
        keys.append(task._paid_key(job).get("WILDCAP_SWITCHLIGHT_KEY"))
    assert keys == [None, None, "secret", "secret"]
