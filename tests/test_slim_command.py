# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Slimming from the terminal, faces one by one and a batch's; what needs the frames and is no worker; and the real
stage, which takes the same frames again."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from core.__main__ import main
from core.batch.record import Batch, BatchFace, write_batch
from core.contract import slimmed, slimming, stages
from core.contract.capture import Capture
from core.contract.messages import Failed, Problem, Reporter
from core.contract.settings import Settings, from_json
from core.frames import back
from core.worker import runner
from core.worker.job import write_job

from . import finished_face
from .finished_face import pictures
from .test_frames import moving_face, take, write_video


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    return finished_face.build(tmp_path_factory.mktemp("slim"))


@pytest.fixture(scope="module")
def finished(root, tmp_path_factory) -> Path:
    return finished_face.make(root, tmp_path_factory.mktemp("finished"))


@pytest.fixture
def capture(finished, tmp_path, root, monkeypatch) -> Capture:
    return finished_face.copy(finished, tmp_path / "batch", root, monkeypatch)


def test_what_reads_the_frames_itself_says_what_to_do(capture):
    slimming.slim(capture, Settings())
    with pytest.raises(Problem, match="frames/ was slimmed away") as caught:
        capture.require("frames/")
    assert "core slim --undo" in caught.value.remedy
    capture.require("head.obj")
    assert main(["white", str(capture.root), "--frame", "a.txt", "--at", "1", "1"]) == 2


def test_the_terminal_lists_removes_and_brings_back(root, capture, capsys):
    before = pictures(capture)
    assert main(["slim", str(capture.root)]) == 0
    told = capsys.readouterr().out
    assert "Frames: 1 files" in told and "Nothing was removed" in told and pictures(capture) == before
    assert main(["slim", str(capture.root), "--yes"]) == 0 and pictures(capture) == {}
    assert main(["status", str(capture.root)]) == 0 and capsys.readouterr().out.count("slimmed away") == 2
    assert main(["slim", str(capture.root)]) == 0 and "Nothing is left that could go." in capsys.readouterr().out
    said = command(root, "slim", capture.root, "--undo")
    assert "Slimmed Files done" in said and pictures(capture) == before
    assert "nothing was slimmed away" in command(root, "slim", capture.root, "--undo")
    assert main(["slim", str(capture.root.parent)]) == 2


def test_of_a_batch_the_faces_that_are_done_are_slimmed_and_the_others_left_and_said(root, capture, capsys):
    folder = capture.root.parent
    write_batch(
        Batch(
            folder, tuple(BatchFace(name, folder / "film.mp4", folder / f"{name}.wildcap") for name in ("zoë", "new"))
        )
    )
    said = command(root, "slim", folder)
    assert (
        "zoë" in said
        and "2 files" in said
        and "new" in said
        and "left, for it is not done: head is next" in said
        and "1 of 2 faces" in said
    )
    assert len(pictures(capture)) == 2
    (folder / "film.mp4").rename(folder / "away.mp4")
    said = command(root, "slim", folder, "--yes")
    assert "film.mp4 is not there any more" in said and "0 of 2 faces" in said and len(pictures(capture)) == 2
    (folder / "away.mp4").rename(folder / "film.mp4")
    command(root, "slim", folder, "--yes")
    assert pictures(capture) == {} and "1 done" in command(root, "batch", "status", folder)


def command(root: Path, *words) -> str:
    """What a command line of the tiny chain says."""
    done = subprocess.run(
        [sys.executable, "-m", "core", *map(str, words)], cwd=root, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_real_stage_takes_the_same_frames_again(tmp_path):
    source = write_video(tmp_path / "film.mp4", [moving_face(i) for i in range(40)])
    capture = Capture(tmp_path / "face.wildcap")
    record, report = take(capture, source, max_frames=6, views=3)
    frames, settings = stages.by_name("frames"), from_json({"frames": {"max_frames": 6, "views": 3}})
    capture.finish(frames, capture.conditions(frames, settings), 1.0, settings, report.figures, "0.2.0")
    before = pictures(capture)
    assert len(before) == 7
    capture.keep_hashes({"frames": {"frames/": slimmed.hash_tree(capture.frames)}})
    shutil.rmtree(capture.frames)
    assert isinstance(runner.run_job(write_job(capture, tool="white_point"), lambda message: None), Failed), (
        "no card is on it"
    )
    assert pictures(capture) == before and slimmed.hashes_of(capture.read()) == {}
    capture.delit.mkdir()
    counted = Reporter("bring_back")
    back.run(capture, settings, counted)
    assert counted.figures == {"frames": 6, "delit_views": 0}
    (capture.frames / record["frames"][2]["name"]).unlink()
    with pytest.raises(Problem, match="is not in this capture any more"):
        back.run(capture, settings, counted)
