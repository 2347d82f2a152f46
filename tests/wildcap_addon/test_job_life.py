# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A job while its artist does other things: other files, undo, other faces' jobs, a disabled add-on, a kill. The worker
is real, its rooms are tiny."""

import json
import os
import socket
import sys
import time
from importlib import import_module

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin, tiny_chain

bpy = pytest.importorskip("bpy")


@pytest.fixture
def jobs(addon, monkeypatch, tmp_path):
    """The add-on's jobs, over a chain of tiny rooms run by this very Python."""
    module = addon("jobs")
    monkeypatch.setattr(module, "ROOT", tiny_chain.build(tmp_path / "code"))
    addon("preferences").get().python = sys.executable
    yield module
    for root in list(module._jobs):
        module.cancel(root)
    finish(module)
    addon("preferences").get().python = ""


def finish(jobs, condition=None, limit_s: float = 60) -> None:
    """Polls as the timer would, to the end or until the condition holds."""
    deadline = time.monotonic() + limit_s
    while jobs.poll():
        if condition is not None and condition():
            return
        assert time.monotonic() < deadline, "the job never ended"
        time.sleep(0.02)
    assert condition is None or condition()


def a_capture(folder, name: str, mood: str = "") -> Capture:
    root = standin.make(folder / f"{name}.wildcap", solved=False)
    (root / "mood.json").write_text(json.dumps({"solve": mood}))
    bpy.ops.wildcap.open_capture(directory=str(root))
    return Capture(root)


def running(capture: Capture) -> bool:
    """Whether somebody is inside; a lock that is just being made is empty."""
    return capture.lock.is_file() and capture.lock.stat().st_size > 0


def pid_of(capture: Capture) -> int:
    return json.loads(capture.lock.read_text(encoding="utf-8"))["pid"]


def alive(pid: int) -> bool:
    """Whether the process runs; one that has ended but that nobody has asked after yet does not."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rsplit(") ", 1)[1][0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def ends(pid: int) -> None:
    """Its last words come a moment before its end."""
    deadline = time.monotonic() + 10
    while alive(pid):
        assert time.monotonic() < deadline, "the worker outlives its job"
        time.sleep(0.02)


def test_jobs_of_several_faces_wait_in_line_and_one_can_leave_it(addon, jobs, tmp_path):
    captures = [a_capture(tmp_path, name, "slow" if name == "a" else "") for name in "abc"]
    roots = [str(capture.root) for capture in captures]
    items = {item.path: item for item in bpy.context.scene.wildcap.captures}
    status, captures_module = addon("status"), addon("captures")

    def solve(*wanted: Capture) -> None:
        for capture in wanted:
            captures_module.add(bpy.context, capture.root)
            bpy.ops.wildcap.solve()

    solve(*captures)
    assert [jobs.of(root).waiting for root in roots] == [False, True, True]
    finish(jobs, lambda: running(captures[0]))
    assert not running(captures[1]) and jobs.stage_label(jobs.of(roots[1])) == "Waiting"
    captures_module.add(bpy.context, captures[1].root)
    status.refresh(bpy.context)
    facts = addon("panel").gather(bpy.context, items[roots[1]])
    assert "another face" in addon("next_step").next_step(facts).state
    bpy.ops.wildcap.cancel()
    assert jobs.of(roots[1]) is None and jobs.of(roots[2]).waiting
    jobs.cancel(roots[0])
    finish(jobs)
    assert [capture.has("maps/normal.png") for capture in captures] == [False, False, True]
    (captures[0].root / "mood.json").write_text("{}")
    solve(captures[0], captures[1])
    finish(jobs)
    assert all(capture.has("maps/normal.png") for capture in captures)


def test_a_job_goes_on_when_another_file_is_opened_and_when_everything_is_undone(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a", "slow")
    root = str(capture.root)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.solve()
    finish(jobs, lambda: running(capture) and jobs.of(root).progress is not None)
    pid = pid_of(capture)
    for _ in range(3):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()
    jobs.poll()
    assert jobs.of(root) is not None and alive(pid)
    bpy.ops.wm.read_homefile(use_empty=True)
    jobs.poll()
    assert jobs.of(root) is not None and alive(pid) and len(bpy.context.scene.wildcap.captures) == 0
    assert [folder for folder, _ in jobs.elsewhere("")] == [root], "the tab tells of it there, too"
    bpy.ops.wildcap.open_capture(directory=root)
    assert jobs.elsewhere(root) == []
    assert jobs.of(addon("captures").root(addon("captures").active(bpy.context))).goal == "solve", (
        "the tab of the capture shows it again"
    )
    bpy.ops.scene.new(type='NEW')
    assert jobs.of(root) is not None
    bpy.ops.wildcap.cancel(capture=root)
    finish(jobs)
    ends(pid)


def test_a_cancelled_second_solve_is_to_be_done_though_the_maps_of_before_are_there(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a")
    bpy.ops.wildcap.solve()
    finish(jobs)
    assert state_of_solve(addon) == "older", "the solver that ran is not this one's"
    (capture.root / "mood.json").write_text(json.dumps({"solve": "slow"}))
    bpy.ops.wildcap.solve()
    finish(jobs, lambda: running(capture) and jobs.of(str(capture.root)).progress is not None)
    jobs.cancel(str(capture.root))
    finish(jobs)
    assert capture.has("maps/normal.png") and state_of_solve(addon) == "to do"


def test_a_solve_in_the_middle_of_painting_takes_the_mask_as_it_is_painted(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    image = addon("paint.session").mask()
    painted = addon("paint.mask_image").mask_values(image).copy()
    painted[10:20, 30:40] = 1
    addon("paint.mask_image").set_values(image, painted)
    bpy.ops.wildcap.solve()
    assert capture.shadow_mask.read_bytes() == addon("paint.mask_image").grey_png(painted)
    jobs.cancel(str(capture.root))
    finish(jobs)
    bpy.ops.wildcap.finish_mask()


def state_of_solve(addon) -> str:
    item = addon("captures").active(bpy.context)
    addon("status").of(item)
    addon("status").refresh(bpy.context)
    return addon("status").of(item).stages["solve"]


def test_disabling_the_add_on_ends_the_worker_and_keeps_what_is_finished(addon, jobs, wildcap, tmp_path):
    import addon_utils

    capture = a_capture(tmp_path, "a", "deaf")
    bpy.ops.wildcap.solve()
    finish(jobs, lambda: running(capture))
    pid = pid_of(capture)
    addon_utils.disable(wildcap, default_set=True)
    addon_utils.enable(wildcap, default_set=True)  # at once: without it no other test could run
    ends(pid)
    assert capture.texture.is_file()


def test_a_killed_worker_is_a_problem_with_a_remedy_and_the_lock_is_taken_over(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a", "slow")
    bpy.ops.wildcap.solve()
    finish(jobs, lambda: running(capture) and jobs.of(str(capture.root)).progress is not None)
    os.kill(pid_of(capture), 9)
    finish(jobs)
    problem = addon("problems").of(str(capture.root))
    assert "killed" in problem.problem and "run again" in problem.remedy
    (capture.root / "mood.json").write_text("{}")
    bpy.ops.wildcap.solve()
    finish(jobs)
    assert addon("problems").of(str(capture.root)) is None and capture.has("maps/normal.png")


def test_a_capture_that_another_blender_works_on_is_refused_by_name(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a")
    capture.lock.write_text(
        json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": "2026-01-01T00:00:00"})
    )
    with pytest.raises(RuntimeError, match=f"process {os.getpid()}"):
        bpy.ops.wildcap.solve()
    capture.lock.unlink()


def test_an_interrupted_solve_is_offered_to_go_on_when_the_file_is_opened_again(addon, jobs, tmp_path):
    capture = a_capture(tmp_path, "a")
    bpy.ops.wildcap.bring_in_head()
    capture.checkpoints.mkdir()
    (capture.checkpoints / "solve.safetensors").write_bytes(b"a checkpoint")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    addon("status").refresh(bpy.context)
    step = addon("next_step").next_step(addon("panel").gather(bpy.context, addon("captures").active(bpy.context)))
    assert step.label == "Continue Solving" and step.operator == "wildcap.solve"
    capture.job.write_text("{}")
    os.utime(capture.job, (1, 1))
    # painted since: a checkpoint of another mask is of no use
    capture.shadow_mask.write_bytes((capture.root / "shadow_mask_auto.png").read_bytes())
    addon("status").refresh(bpy.context)
    facts = addon("panel").gather(bpy.context, addon("captures").active(bpy.context))
    assert addon("next_step").next_step(facts).label == "Solve"


def test_how_long_a_quality_takes_is_learned_from_the_last_solve(addon, jobs, tmp_path):
    timings = addon("timings")
    settings = import_module(timings.__package__.replace("wildcap_addon", "core.settings.settings"))
    timings._rates.clear()
    assert timings.describe_minutes("cpu") == ""
    a_capture(tmp_path, "a")
    bpy.ops.wildcap.solve()
    finish(jobs)
    assert "Standard" in timings.describe_minutes("cpu") and timings.describe_minutes("cuda") == ""
    standard = settings.preset("standard")
    timings.record(standard, 240.0)
    assert timings.minutes("standard", "cpu") == pytest.approx(4.0)
    ratio = timings.work(settings.preset("draft")) / timings.work(standard)
    assert timings.minutes("draft", "cpu") == pytest.approx(4.0 * ratio)
    timings.record(settings.from_json({"edited_part": True}), 1.0)
    assert timings.minutes("standard", "cpu") == pytest.approx(4.0), "a part is no measure"
    timings.unregister()
    timings.register()
    assert timings.minutes("standard", "cpu") == pytest.approx(4.0), "it is known in the next Blender"
    timings._file().unlink()
    timings.register()
    assert timings.minutes("standard", "cpu") is None


def test_the_running_solve_is_shown_on_the_head_and_leaves_no_trace(addon, jobs, tmp_path):
    live, head_name = addon("solve.live"), addon("head").PREVIEW
    capture = a_capture(tmp_path, "a", "slow")
    bpy.ops.wildcap.bring_in_head()
    root = str(capture.root)
    nodes = bpy.context.object.active_material.node_tree.nodes
    shown = nodes.active.name
    bpy.ops.wildcap.solve()
    finish(jobs, lambda: running(capture))
    seen = []
    for colour in ((255, 0, 0), (0, 0, 255)):
        capture.preview.mkdir(exist_ok=True)
        (capture.preview / "albedo.png").write_bytes(standin.plain(colour))
        blocks = len(bpy.data.images)
        live.update(root)
        assert nodes.active.name == head_name and len(bpy.data.images) == blocks, "a timer makes no data-blocks"
        seen.append(tuple(round(v) for v in nodes.active.image.pixels[:3]))
    assert seen == [(1, 0, 0), (0, 0, 1)]
    bpy.ops.wildcap.paint_mask()
    (capture.preview / "albedo.png").write_bytes(standin.plain((0, 255, 0)))
    live.update(root)
    kept = tuple(round(v) for v in nodes[head_name].image.pixels[:3])
    assert kept == (0, 0, 1), "nothing is touched while somebody paints"
    bpy.ops.wildcap.finish_mask()
    jobs.cancel(root)
    finish(jobs)
    assert nodes.active.name == shown
    for name in ("diffuse_albedo.png", "specular_albedo.png", "normal.png"):
        capture.maps.mkdir(exist_ok=True)
        (capture.maps / name).write_bytes(standin.plain((128, 128, 255)))
    bpy.ops.wildcap.assemble_material()
    assert head_name not in bpy.context.object.active_material.node_tree.nodes
    assert not any(head_name in image.name for image in bpy.data.images)
