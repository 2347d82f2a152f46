# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A job while its artist does other things: other files, undo, other faces' jobs, a disabled add-on, a kill. The worker
is real, its rooms are tiny."""

import json
import os
import struct
import sys
from importlib import import_module
from pathlib import Path
from unittest.mock import Mock

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.batch_faces import alive
from tests.fixtures.polled_jobs import follow, wait

bpy = pytest.importorskip("bpy")


def make(folder, name: str = "a", mood: str = "") -> Capture:
    root = standin.make(folder / f"{name}.wildcap", solved=False)
    set_mood(capture := Capture(root), mood)
    bpy.ops.wildcap.open_capture(directory=str(root))
    return capture


def set_mood(capture: Capture, mood: str) -> None:
    (capture.root / "mood.json").write_text(json.dumps({"solve": mood}))


def running(capture: Capture) -> bool:
    """Whether somebody is inside; a lock that is just being made is empty."""
    return capture.lock.is_file() and capture.lock.stat().st_size > 0


def pid_of(capture: Capture) -> int:
    return json.loads(capture.lock.read_text(encoding="utf-8"))["pid"]


def solve_until_progress(addon, capture: Capture) -> int:
    """The process that solves."""
    bpy.ops.wildcap.solve()
    follow(addon, lambda: running(capture) and addon("jobs").of(str(capture.root)).progress is not None)
    return pid_of(capture)


def wait_for_end(pid: int) -> None:
    """A worker's last words come a moment before its end."""
    wait(lambda: not alive(pid))


def step(addon):
    addon("status").refresh(bpy.context)
    return addon("next_step").next_step(addon("panel").gather(bpy.context, addon("captures").active(bpy.context)))


def test_jobs_of_several_faces_wait_in_line_and_one_can_leave_it(addon, jobs, tmp_path):
    captures = [make(tmp_path, name, "slow" if name == "a" else "") for name in "abc"]
    roots = [str(capture.root) for capture in captures]

    def choose(capture: Capture) -> None:
        addon("captures").add(bpy.context, capture.root)

    for capture in captures:
        choose(capture)
        bpy.ops.wildcap.solve()
    assert [jobs.of(root).waiting for root in roots] == [False, True, True]
    follow(addon, lambda: running(captures[0]))
    assert not running(captures[1]) and jobs.stage_label(jobs.of(roots[1])) == "Waiting"
    choose(captures[1])
    assert "another face" in step(addon).state
    bpy.ops.wildcap.cancel()
    assert jobs.of(roots[1]) is None and jobs.of(roots[2]).waiting
    jobs.cancel(roots[0])
    follow(addon)
    assert [capture.has("maps/normal.png") for capture in captures] == [False, False, True]
    assert "Cancelled" in addon("problems").of(roots[0]).problem


def test_a_job_goes_on_when_another_file_is_opened_and_when_everything_is_undone(addon, jobs, tmp_path):
    capture = make(tmp_path, mood="slow")
    root = str(capture.root)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.ed.undo_push(message="before")
    pid = solve_until_progress(addon, capture)
    for _ in range(3):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()
    jobs.poll()
    assert jobs.of(root) is not None and alive(pid)
    bpy.ops.wm.read_homefile(use_empty=True)
    jobs.poll()
    assert alive(pid) and len(bpy.context.scene.wildcap.captures) == 0
    assert [folder for folder, _ in jobs.elsewhere("")] == [root], "the tab tells of it there, too"
    bpy.ops.wildcap.open_capture(directory=root)
    assert jobs.elsewhere(root) == [] and jobs.of(root).goal == "solve"
    bpy.ops.scene.new(type='NEW')
    bpy.ops.wildcap.cancel(capture=root)
    follow(addon)
    wait_for_end(pid)


def test_a_solve_in_the_middle_of_painting_takes_the_mask_as_it_is_painted(addon, tmp_path, monkeypatch):
    capture, mask_image = make(tmp_path), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    image = addon("paint.session").mask()
    painted = mask_image.mask_values(image).copy()
    painted[10:20, 30:40] = 1
    mask_image.set_values(image, painted)
    monkeypatch.setattr(addon("preferences"), "require_python", lambda: Path(sys.executable))
    monkeypatch.setattr(addon("jobs"), "start_worker", Mock())
    bpy.ops.wildcap.solve()
    assert capture.shadow_mask.read_bytes() == mask_image.grey_png(painted)
    bpy.ops.wildcap.finish_mask()


def test_disabling_the_add_on_ends_the_worker(addon, jobs, wildcap, tmp_path):
    import addon_utils

    capture = make(tmp_path, mood="deaf")
    bpy.ops.wildcap.solve()
    follow(addon, lambda: running(capture))
    pid = pid_of(capture)
    addon_utils.disable(wildcap, default_set=True)
    addon_utils.enable(wildcap, default_set=True)  # at once: without it no other test could run
    wait_for_end(pid)


def test_a_job_that_fails_or_is_killed_is_a_problem_with_a_remedy_and_the_next_takes_over(addon, jobs, tmp_path):
    capture, problems = make(tmp_path, mood="finding"), addon("problems")
    bpy.ops.wildcap.solve()
    assert not bpy.ops.wildcap.solve.poll(), "one job per capture"
    follow(addon)
    assert problems.of(str(capture.root)).problem == "The face is not there."
    set_mood(capture, "slow")
    os.kill(solve_until_progress(addon, capture), 9)
    follow(addon)
    assert "killed" in problems.of(str(capture.root)).problem and problems.of(str(capture.root)).remedy
    set_mood(capture, "")
    bpy.ops.wildcap.solve()
    follow(addon)
    assert problems.of(str(capture.root)) is None and capture.has("maps/normal.png")


def test_an_interrupted_solve_is_offered_to_go_on_when_the_file_is_opened_again(addon, monkeypatch, tmp_path):
    monkeypatch.setattr(addon("preferences"), "python", lambda: Path(sys.executable))
    capture = make(tmp_path)
    bpy.ops.wildcap.bring_in_head()
    capture.checkpoints.mkdir()
    (capture.checkpoints / "solve.safetensors").write_bytes(b"a checkpoint")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert (step(addon).label, step(addon).operator) == ("Continue Solving", "wildcap.solve")
    capture.job.write_text("{}")
    os.utime(capture.job, (1, 1))
    # painted since: a checkpoint of another mask is of no use
    capture.shadow_mask.write_bytes(capture.shadow_mask_auto.read_bytes())
    assert step(addon).label == "Solve"


def test_a_timer_that_fails_tells_it_and_goes_on(addon, monkeypatch):
    jobs, problems, incoming = addon("jobs"), addon("problems"), addon("incoming")
    with monkeypatch.context() as patched:
        patched.setattr(jobs, "poll", lambda: 1 / 0)
        assert jobs._tick() is None and "An error inside WildCap" in problems.of("").problem
    monkeypatch.setattr(incoming, "waits", lambda: True)
    for failure, words in (
        (ZeroDivisionError(), "An error inside WildCap"),
        (jobs.Problem("The head is damaged.", "Run it again."), "is damaged"),
    ):
        monkeypatch.setattr(incoming, "bring_in", Mock(side_effect=failure))
        assert jobs._tick() == jobs.INTERVAL_S and words in problems.of("").problem


def test_the_edited_part_can_be_solved_when_only_the_mask_changed(addon, capture, item, monkeypatch):
    jobs, status = addon("jobs"), addon("status")
    mask_edit = import_module(status.__package__.replace("wildcap_addon", "core.capture.mask_edit"))
    folder = addon("captures").folder(item)
    status.refresh(bpy.context)
    assert "No solve" in status.of(item).whole_solve and not bpy.ops.wildcap.solve_edited.poll()
    conditions = mask_edit.conditions(folder, addon("properties").settings(item))
    header = json.dumps({"__metadata__": {mask_edit.FIELD: json.dumps(conditions)}}).encode()
    folder.solved.write_bytes(struct.pack("<Q", len(header)) + header)
    status.refresh(bpy.context)
    assert status.of(item).whole_solve == "" and bpy.ops.wildcap.solve_edited.poll()
    monkeypatch.setattr(addon("preferences"), "require_python", lambda: Path(sys.executable))
    monkeypatch.setattr(jobs, "start_worker", Mock())
    bpy.ops.wildcap.solve_edited()
    job = json.loads(folder.job.read_text(encoding="utf-8"))
    assert job["settings"]["edited_part"] is True and job["from"] == "solve"
    bpy.ops.wildcap.solve()
    job = json.loads(folder.job.read_text(encoding="utf-8"))
    assert "edited_part" not in job["settings"], "the next solve is whole again"
    item.seed += 1
    status.refresh(bpy.context)
    assert "settings changed" in status.of(item).whole_solve and not bpy.ops.wildcap.solve_edited.poll()
