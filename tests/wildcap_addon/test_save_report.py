# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Save Report in Blender, beside every problem; and cameras of a capture that are damaged, or a stranger's."""

import struct
import time
import zipfile
from unittest.mock import Mock

import pytest

from core.capture.messages import Problem

bpy = pytest.importorskip("bpy")


class Buttons:
    """A layout that notes its operators."""

    def __init__(self):
        self.names = []

    def operator(self, name, **_):
        self.names.append(name)

    def __getattr__(self, name):
        return lambda *_, **__: self


def follow(addon):
    end = time.monotonic() + 60
    while addon("jobs").poll():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_report_is_saved_with_blender_s_version_and_no_name_of_the_capture(addon, capture, tmp_path):
    (capture / "logs").mkdir(exist_ok=True)
    (capture / "logs" / "solve.log").write_text(f"reading {capture}/texture.exr of Zoë et moi")
    target = tmp_path / "about it.zip"
    bpy.ops.wildcap.save_report(filepath=str(target))
    follow(addon)
    assert str(target) in addon("problems").of("").problem and "before you send it" in addon("problems").of("").remedy
    with zipfile.ZipFile(target) as archive:
        assert bpy.app.version_string in archive.read("report.json").decode()
        assert archive.read("logs/solve.log").decode() == "reading <capture>/texture.exr of <removed>"
    before = target.read_bytes()
    bpy.ops.wildcap.save_report(filepath=str(target))
    follow(addon)
    assert "already exists" in addon("problems").of("").problem and target.read_bytes() == before


def test_the_button_stands_beside_a_problem_and_not_beside_a_notice(addon):
    problems = addon("problems")
    for kind, there in ((Problem, True), (problems.Notice, False)):
        buttons = Buttons()
        problems.draw(buttons, kind("It is broken.", "Mend it."), 400)
        assert buttons.names == (["wildcap.save_report"] if there else [])


def test_a_timer_that_fails_tells_it_and_goes_on(addon, monkeypatch):
    jobs, problems = addon("jobs"), addon("problems")
    monkeypatch.setattr(jobs, "poll", lambda: 1 / 0)
    assert jobs._tick() is None
    assert "An error inside WildCap stopped listening" in problems.of("").problem
    problems.clear("")
    monkeypatch.undo()
    monkeypatch.setattr(addon("incoming"), "waits", lambda: True)
    for failure, said in (
        (ZeroDivisionError(), "An error inside WildCap stopped"),
        (jobs.Problem("The head is damaged.", "Run it again."), "is damaged"),
    ):
        monkeypatch.setattr(addon("incoming"), "bring_in", Mock(side_effect=failure))
        assert jobs._tick() == jobs.INTERVAL_S and said in problems.of("").problem


def cameras(folder, name: bytes = b"00000.jpg", focal: float = 900.0, width: int = 720, count: int = 1) -> None:
    folder.mkdir(exist_ok=True)
    camera = struct.pack("<iiQQ3d", 1, 0, width, 960, focal, 360, 480)
    (folder / "cameras.bin").write_bytes(struct.pack("<Q", count) + camera)
    (folder / "images.bin").write_bytes(
        struct.pack("<Qi7dI", count, 1, 1, 0, 0, 0, 0, 0, 1, 1) + name + b"\0" + struct.pack("<Q", 0)
    )


def test_cameras_that_are_damaged_or_a_stranger_s_are_refused(addon, tmp_path):
    colmap_cameras = addon("reconstruct.colmap_cameras")
    cameras(tmp_path)
    assert [camera.name for camera in colmap_cameras.read(tmp_path)] == ["00000.jpg"]
    for spoiled in (
        {"name": b"../../private/x.jpg"},
        {"focal": float("nan")},
        {"focal": 0.0},
        {"width": 2**40},
        {"width": 0},
        {"count": 2**60},
        {"name": b"\xff.jpg"},
    ):
        cameras(tmp_path, **spoiled)
        with pytest.raises(Exception, match="cannot be read") as refusal:
            colmap_cameras.read(tmp_path)
        assert type(refusal.value).__name__ == "Problem"
