# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs and the solver's Python, seen from Blender. Timers do not fire in the wheel, so the tests poll."""

import json
import os
import struct
import sys
import time
import venv
from importlib import import_module
from pathlib import Path

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def test_a_python_that_lacks_packages_is_refused_by_name(addon, tmp_path):
    operators = addon("setup.operators")
    with pytest.raises(Exception, match="There is no Python"):
        operators.interpreter(tmp_path)
    bare = tmp_path / "bare"
    venv.create(bare, with_pip=False, symlinks=True)
    with pytest.raises(RuntimeError, match="torch .* is missing"):
        bpy.ops.wildcap.use_python(filepath=str(bare))
    assert addon("preferences").get().python == ""


def test_a_job_without_a_solver_python_says_so(addon, capture):
    addon("preferences").get().python = ""
    with pytest.raises(RuntimeError, match="solver is not set up"):
        bpy.ops.wildcap.solve()


def test_a_failing_job_ends_as_a_problem_of_its_capture(addon, tmp_path):
    video = tmp_path / "not a video.mp4"
    video.write_text("no video", encoding="utf-8")
    preferences = addon("preferences").get()
    preferences.python, preferences.captures = sys.executable, str(tmp_path / "captures")
    bpy.ops.wildcap.choose_video(filepath=str(video))
    bpy.ops.wildcap.reconstruct()
    jobs = addon("jobs")
    root = str(tmp_path / "captures" / "not a video.wildcap")
    assert jobs.of(root).goal == "reconstruct"
    assert not bpy.ops.wildcap.reconstruct.poll(), "one job per capture"
    deadline = time.monotonic() + 60
    while jobs.poll():
        assert time.monotonic() < deadline, "the worker never ended"
        time.sleep(0.05)
    problem = addon("problems").of(root)
    assert problem is not None and problem.remedy
    preferences.python = ""


def test_cancel_ends_a_job_within_two_seconds(addon, capture):
    preferences = addon("preferences").get()
    preferences.python = sys.executable
    bpy.ops.wildcap.solve()
    jobs = addon("jobs")
    bpy.ops.wildcap.cancel()
    started = time.monotonic()
    while jobs.poll():
        assert time.monotonic() - started < 2.5
        time.sleep(0.05)
    assert "Cancelled" in addon("problems").of(str(capture)).problem
    preferences.python = ""


def test_the_solver_is_not_downloaded_while_blender_works_offline(addon):
    assert not bpy.app.online_access
    with pytest.raises(RuntimeError, match="work offline"):
        bpy.ops.wildcap.install_solver()
    assert addon("jobs").of("") is None


def test_an_installation_is_polled_like_a_job_and_sets_the_python(addon, tmp_path):
    jobs, preferences = addon("jobs"), addon("preferences")
    messages = jobs.messages

    class Installation:
        """Says what a real one says, without a download."""

        running = True

        def start(self):
            self.waiting = [messages.Progress("environment", 1, 2, "Collecting torch"), messages.Done(1.0)]

        def poll(self):
            said = [self.waiting.pop(0)]
            self.running = bool(self.waiting)
            return said

    jobs.start_worker("", "install", Installation(), lambda: preferences.set_python(Path(sys.executable)))
    assert jobs.poll() and jobs.of("").progress.text == "Collecting torch"
    assert not jobs.poll()
    assert preferences.python() == Path(sys.executable)
    preferences.set_python(None)


def test_the_solver_goes_to_a_short_folder_and_only_environments_are_removed(addon, tmp_path):
    preferences = addon("preferences")
    assert preferences.environment_folder() == Path.home() / ".wildcap" / "solver"
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "novel.txt").write_text("", encoding="utf-8")
    preferences.get().environment = str(mine)
    with pytest.raises(RuntimeError, match="is no environment that WildCap made"):
        bpy.ops.wildcap.remove_solver()
    preferences.get().environment = ""
    assert (mine / "novel.txt").is_file()


def test_the_preview_is_read_again_when_it_is_newer(addon, tmp_path):
    preview = addon("solve.preview")
    picture = tmp_path / "albedo.png"
    seen = []
    for number, colour in enumerate([(255, 0, 0), (0, 255, 0), (0, 0, 255)]):
        picture.write_bytes(standin.plain(colour))
        os.utime(picture, (1e9 + number, 1e9 + number))  # Blender tells thumbnails apart by whole seconds
        seen.append(
            (preview.icon(picture), tuple(round(c) for c in preview._icons[str(picture)].image_pixels_float[:3]))
        )
    preview.forget()
    assert len({icon for icon, _ in seen}) == 1
    assert [colour for _, colour in seen] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]


def test_the_edited_part_can_be_solved_when_only_the_mask_changed(addon, capture):
    captures, properties, status = addon("captures"), addon("properties"), addon("status")
    mask_edit = import_module(addon("status").__package__.replace("wildcap_addon", "core.capture.mask_edit"))
    item, folder = captures.active(bpy.context), Capture(capture)
    status.refresh(bpy.context)
    assert "No solve" in status.of(item).whole_solve and not bpy.ops.wildcap.solve_edited.poll()
    conditions = mask_edit.conditions(captures.folder(item), properties.settings(item))
    header = json.dumps({"__metadata__": {mask_edit.FIELD: json.dumps(conditions)}}).encode()
    folder.solved.write_bytes(struct.pack("<Q", len(header)) + header)
    status.refresh(bpy.context)
    assert status.of(item).whole_solve == "" and bpy.ops.wildcap.solve_edited.poll()
    preferences = addon("preferences").get()
    preferences.python = sys.executable
    bpy.ops.wildcap.solve_edited()
    asked = json.loads(folder.job.read_text(encoding="utf-8"))
    assert asked["settings"]["edited_part"] is True and asked["from"] == "solve"
    bpy.ops.wildcap.cancel()
    while addon("jobs").poll():
        time.sleep(0.05)
    bpy.ops.wildcap.solve()
    assert "edited_part" not in json.loads(folder.job.read_text(encoding="utf-8"))["settings"], (
        "the next solve is whole again"
    )
    bpy.ops.wildcap.cancel()
    while addon("jobs").poll():
        time.sleep(0.05)
    preferences.python = ""
    item.seed += 1
    status.refresh(bpy.context)
    assert "settings changed" in status.of(item).whole_solve and not bpy.ops.wildcap.solve_edited.poll()
