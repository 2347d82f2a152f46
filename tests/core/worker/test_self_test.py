# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-Test: the shipped sample head solved again as a worker does it, a score that a sound machine has, and words for
one that it has not."""

import json
from pathlib import Path

import numpy as np
import pytest

from core.__main__ import main
from core.capture import sample_head
from core.capture.messages import Done, Failed, StageDone
from core.imaging import images
from core.stages.solve import self_test as tool
from core.worker import runner, self_test, terminal
from core.worker.job import read_job

SAMPLE = Path(__file__).parents[3] / "research" / "people" / "sample"


@pytest.fixture
def capture(tmp_path):
    return self_test.prepare(tmp_path)


def solved(noise: float):
    """Stands for a solve: the shipped albedo with noise of this deviation, sRGB, at the draft's size."""

    def solve(capture, settings, report):
        shipped = images.resize(images.read_srgb(sample_head.SHIPPED / "maps" / "diffuse_albedo.png"), 512, 512)
        drawn = np.random.default_rng(0).normal(0, noise, shipped.shape).astype(np.float32)
        images.write_srgb(capture.maps / "diffuse_albedo.png", shipped + drawn, bits=16)

    return solve


def test_the_sample_is_solved_with_its_own_tone_and_the_draft(capture):
    job = read_job(capture.job)
    settings = job.settings
    stored = (SAMPLE / "skin_tone.txt").read_text(encoding="ascii").strip()
    assert settings.solve.skin_tone == stored == self_test.SKIN_TONE
    assert settings.solve.size == 512 and settings.solve.guidance == "proximal" and settings.device == "auto"
    assert job.tool.name == "self_test" and capture.texture.is_file()
    assert not sample_head.SHIPPED.samefile(capture.root)


def test_the_command_solves_a_copy_and_takes_it_away(monkeypatch):
    """The solve itself takes most of a minute: `.ci/run` has this command do it."""
    jobs = []
    monkeypatch.setattr(terminal, "follow", lambda root, capture, job, _: jobs.append(read_job(job)) or 0)
    assert main(["self-test", "--device", "cpu"]) == 0
    (job,) = jobs
    assert job.tool.name == "self_test" and job.settings.device == "cpu" and not job.capture.root.exists()


@pytest.mark.parametrize(("above_db", "passes"), [(1.0, True), (-1.0, False)])
def test_the_score_is_that_of_the_albedo_and_what_lies_below_the_expected_fails(capture, monkeypatch, above_db, passes):
    expected = json.loads(tool.EXPECTED_FILE.read_text(encoding="utf-8"))
    scores = np.concatenate(list(expected["scores_db"].values()))
    assert expected["mean_db"] == pytest.approx(scores.mean(), abs=1e-3)
    assert expected["deviation_db"] == pytest.approx(scores.std(ddof=1), abs=1e-3)
    least_db = expected["mean_db"] - tool.MAX_DEVIATIONS * expected["deviation_db"]
    assert scores.min() > least_db, "what was measured passes"
    score, messages = least_db + above_db, []
    monkeypatch.setattr(tool.solve, "run", solved(10 ** (-score / 20)))
    final = runner.run_job(capture.job, messages.append)
    assert isinstance(final, Done if passes else Failed)
    if passes:
        (figures,) = (message.figures for message in messages if isinstance(message, StageDone))
        assert figures["score_db"] == pytest.approx(score, abs=0.5) and figures["seconds"] >= 0
    else:
        assert "Install Solver" in final.remedy


class TestInBlender:
    """The button: where it can be clicked, what it shows, what it leaves behind."""

    @pytest.fixture
    def room(self, addon, monkeypatch, tmp_path):
        bpy = pytest.importorskip("bpy")
        monkeypatch.setattr(addon("preferences"), "python", lambda: tmp_path / "python")
        yield bpy, addon
        addon("jobs")._jobs.clear()
        addon("preferences").set_python(None)
        addon("preferences").get().tested = ""

    def test_it_is_greyed_out_without_a_solver_and_while_one_works(self, room, monkeypatch):
        bpy, addon = room
        jobs = addon("jobs")
        assert bpy.ops.wildcap.self_test.poll()
        for place, goal in (("/elsewhere.wildcap", "solve"), ("", "install")):
            jobs._jobs[place] = jobs.Job(goal, None)
            assert not bpy.ops.wildcap.self_test.poll()
            jobs._jobs.clear()
        monkeypatch.setattr(addon("preferences"), "python", lambda: None)
        assert not bpy.ops.wildcap.self_test.poll()

    def test_it_says_the_score_and_the_seconds_and_takes_its_copy_away(self, room, monkeypatch, tmp_path):
        bpy, addon = room
        jobs, module = addon("jobs"), addon("setup.self_test")
        folders = []

        class Ended:
            running = True

            def __init__(self, python, root, job, log):
                folders.append(job.parent.parent)
                assert job.is_file()

            def start(self):
                pass

            def poll(self):
                self.running = False
                figures = {"score_db": 33.21, "expected_db": 32.5, "seconds": 40.7}
                return [jobs.messages.StageDone("self_test", 41.0, False, figures), jobs.messages.Done(42.0)]

        monkeypatch.setattr(module, "Worker", Ended)
        bpy.ops.wildcap.self_test()
        assert jobs.of("").goal == "test" and folders[0].is_dir()
        jobs.poll()
        tested = addon("preferences").get().tested
        assert (
            all(figure in tested for figure in ("33.2", "32.5", "41 s")) and addon("problems").of("").problem == tested
        )
        assert not folders[0].exists() and jobs.of("") is None
        addon("preferences").set_python(tmp_path / "another" / "python")
        assert addon("preferences").get().tested == "", "another solver was not tested"
