# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs over the tiny chain, run in this process: what is skipped, and the problem and remedy of every way to fail."""

import errno
import json
import os
import re
from pathlib import Path

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import storage_problem
from core.capture.messages import Done, Failed
from core.capture.report import findings
from core.worker import runner
from core.worker.job import read_job, write_job
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_chain import contents, finished, run_here, tiny_room


@pytest.fixture
def video(tmp_path) -> Path:
    path = tmp_path / "Vidéo de l'été.mp4"
    path.write_bytes(b"stands in for a video")
    return path


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    monkeypatch.setattr(runner, "_room", tiny_room)
    return Capture(tmp_path / "Mon visage é.wildcap")


def test_a_job_runs_every_stage_in_order_and_a_second_run_skips_them(capture, video):
    messages = run_here(capture, source=video)
    assert finished(messages) == dict.fromkeys(stages.ALWAYS, False) and isinstance(messages[-1], Done)
    assert list(finished(messages)) == list(stages.ALWAYS)
    assert capture.read()["stages"]["solve"]["figures"] == {"size_px": 64}
    assert "4K Maps" in capture.report.read_text(encoding="utf-8")
    before = contents(capture)
    messages = run_here(capture)
    assert all(finished(messages).values()) and isinstance(messages[-1], Done)
    assert contents(capture) == before and not capture.lock.exists() and not list(capture.root.rglob(".*"))


def test_from_forces_and_until_ends(capture, video):
    run_here(capture, source=video, last="texture")
    again = finished(run_here(capture, first="scan", last="delight"))
    assert again == {"scan": False, "registration": False, "delight": False}
    rest = finished(run_here(capture, last="shadow_mask"))
    assert rest == {**dict.fromkeys(stages.NAMES[:6], True), "shadow_mask": False}


@pytest.mark.parametrize(
    ("mood", "problem"),
    [
        ("finding", "The face is not there."),
        ("bug", "An error inside WildCap stopped the stage scan (WC-"),
        ("memory", "There was not enough memory for the stage scan."),
        ("full", "The disk is full"),
        ("module", "The solver's Python has no module named a_module_that_is_not_there"),
        ("nothing", "An error inside WildCap stopped the stage scan (WC-"),
    ],
)
def test_every_way_to_fail_is_a_problem_with_a_remedy(capture, video, mood, problem):
    final = run_here(capture, {"scan": mood}, source=video)[-1]
    assert isinstance(final, Failed) and final.stage == "scan" and final.problem.startswith(problem)
    assert final.remedy.endswith((".", ".log")) and "Traceback" not in final.problem + final.remedy
    assert [f["problem"] for f in findings(capture.read())] == ([final.problem] if mood == "finding" else [])
    if mood == "bug":
        log = (capture.logs / "scan.log").read_text(encoding="utf-8")
        assert "Traceback" in log and "ZeroDivisionError" in log and str(capture.logs / "scan.log") in final.remedy
        assert re.search(r"WC-[0-9a-f]{6}", final.problem)[0] in log
    assert finished(run_here(capture, last="scan")) == {"frames": True, "cameras": True, "scan": False}


def test_a_rerun_that_failed_is_not_taken_for_the_result_it_was_to_replace(capture, video):
    run_here(capture, source=video, last="cameras")
    run_here(capture, {"cameras": "bug"}, first="cameras", last="cameras")
    assert finished(run_here(capture, last="cameras")) == {"frames": True, "cameras": False}


@pytest.mark.parametrize(("code", "words"), [(errno.EROFS, "read-only"), (errno.EIO, os.strerror(errno.EIO))])
def test_a_write_that_fails_is_named_by_the_file_it_was_for(tmp_path, code, words):
    path = tmp_path / ".maps.123.tmp" / "normal.png"
    problem = runner.explained(OSError(code, os.strerror(code), str(path)), "solve", tmp_path / "solve.log")
    assert words in problem.problem and str(tmp_path / "maps" / "normal.png") in problem.problem
    assert problem.problem == storage_problem(OSError(code, os.strerror(code)), path).problem


def test_a_video_that_is_gone_is_missed_only_until_its_frames_are_taken(capture, video):
    assert run_here(capture)[-1].problem == "This capture has no video yet."
    aside = video.with_suffix(".aside")
    video.rename(aside)
    final = run_here(capture, source=video)[-1]
    assert isinstance(final, Failed) and str(video) in final.problem
    aside.rename(video)
    run_here(capture, source=video, last="frames")
    video.unlink()
    messages = run_here(capture, source=video, last="cameras")
    assert isinstance(messages[-1], Done) and finished(messages) == {"frames": True, "cameras": False}
    assert isinstance(run_here(capture, first="frames")[-1], Failed)


def test_another_video_does_not_slip_into_a_capture(capture, video):
    run_here(capture, source=video, last="frames")
    other = video.with_name("other.mp4")
    other.write_bytes(b"another face")
    final = run_here(capture, source=other)[-1]
    assert isinstance(final, Failed) and video.name in final.problem and "other.mp4" in final.problem
    assert isinstance(run_here(capture, source=other, first="frames", last="frames")[-1], Done)


def test_jobs_that_cannot_be_are_refused(capture, video):
    torch = pytest.importorskip("torch")
    device = "cuda" if not torch.cuda.is_available() else "mps"
    assert f"no device {device}" in run_here(capture, first="solve", settings={"device": device})[-1].problem
    final = run_here(capture, first="solve")[-1]
    assert isinstance(final, Failed) and final.stage == "solve" and "texture.exr" in final.problem
    for job, words in (
        ({"settings": {"device": "abacus"}}, "'abacus'"),
        ({"first": "solve", "last": "frames"}, "comes after"),
        ({"tool": "lunch"}, "'lunch'"),
    ):
        refuses(words, write_job, capture, source=video, **job)
    for text, words in (
        ("{", "cannot be read"),
        (json.dumps({"capture": ".", "settings": {"registration": -1}}), "cannot be used: .* registration"),
    ):
        capture.job.write_text(text, encoding="utf-8")
        refuses(words, read_job, capture.job)
        assert isinstance(runner.run_job(capture.job), Failed)


@pytest.mark.parametrize("fails", [False, True])
def test_the_frames_tell_the_skin_tone_unasked_and_a_failure_stops_nothing(capture, video, monkeypatch, fails):
    """So the panel can mark it from the moment that there are frames, also in a copy of the capture."""

    class Tool:
        @staticmethod
        def run(capture, settings, report):
            assert (capture.root / "frames").is_dir()
            report.figure("skin_tone_srgb", [0.5, 0.4, 0.3])
            report.finding("Skin tone: estimated.", "Choose it if it looks wrong.")
            if fails:
                raise ValueError("no eyes")

    monkeypatch.setattr(runner, "_room", lambda step: Tool if step.name == "skin_tone" else tiny_room(step))
    messages = run_here(capture, source=video, last="cameras")
    record = capture.read()["stages"]
    figures = record["frames"]["figures"]
    assert isinstance(messages[-1], Done) and figures["size_px"] == 64 and not record["frames"]["findings"]
    assert ("skin_tone_srgb" in figures) == (not fails) and "skin_tone_srgb" not in record["cameras"]["figures"]
