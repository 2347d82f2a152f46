# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills over the real stages: a handful of trials, other ones each time, and that the judge of them finds what is
wrong."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("OpenImageIO")
pycolmap = pytest.importorskip("pycolmap")
if not sys.platform.startswith("linux"):
    pytest.skip("kills are tried on Linux", allow_module_level=True)

import resource  # noqa: E402

import numpy as np  # noqa: E402
import torch  # noqa: E402
from safetensors import SafetensorError  # noqa: E402

from core.capture.files import replacing_folder  # noqa: E402
from core.capture.hashes import read_hash  # noqa: E402
from core.capture.messages import Problem  # noqa: E402
from core.geometry.models import read_model, write_model  # noqa: E402
from core.solver.lighting import Lights  # noqa: E402
from core.solver.objective import State  # noqa: E402
from core.stages.solve import checkpoint  # noqa: E402
from research.benchmarks.kills import judge, worker  # noqa: E402
from research.benchmarks.kills.capture import BESIDE, STRANGERS, Undisturbed, capture_at, copy_place  # noqa: E402
from tests.fixtures.recorded import make_entry  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
TRIALS = 5


def test_a_handful_of_kills_loses_nothing_and_ends_in_the_same_bytes():
    seed = time.time_ns() % 10**6
    words = f"research.benchmarks.kills --count {TRIALS} --seed {seed} --until scan --delighter none".split()
    command = [sys.executable, "-m", *words]
    ended = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stdout[-4000:] + ended.stderr[-2000:]


@pytest.fixture
def place(tmp_path) -> Path:
    """A capture with the user's files and one stage's output; the same beside it as the end of an undisturbed run."""
    place = tmp_path / "end"
    for name, content in STRANGERS.items():
        path = capture_at(place).root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    (place / BESIDE).write_bytes(STRANGERS["shopping.txt"])
    capture_at(place).json.write_text(json.dumps({"format": 2, "source": "", "stages": {"frames": make_entry()}}))
    (capture_at(place).frames / "00000.jpg").write_bytes(b"a frame")
    return copy_place(place, tmp_path / "place")


@pytest.fixture
def undisturbed(place) -> Undisturbed:
    known = {"frames/00000.jpg": {read_hash(capture_at(place).frames / "00000.jpg")}}
    return Undisturbed(place.parent, {}, ("frames",), known=known)


def test_the_judge_is_content_with_what_is_whole_and_finds_every_fault(place, undisturbed):
    root, known = capture_at(place).root, undisturbed.known
    assert judge.judge_kill(place, known) == [] and judge.judge_resume(place, undisturbed, "frames") == []
    for name, content, fault in (
        ("frames/00000.jpg", b"a fra", "no complete content"),
        ("frames/00001.jpg", b"", "no complete content"),
        ("frames/retouched.psd", b"", "is changed"),
        ("capture.json", b"{", "is no JSON"),
        ("report.html", b"<html>", "is cut off"),
        ("../anna.txt", b"", "beside the capture is changed"),
        ("preview/albedo.png", b"\x89PNG", "cannot be read"),
        ("checkpoints/solve.safetensors", b"\1", "cannot be read"),
    ):
        before = (root / name).read_bytes() if (root / name).exists() else None
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_bytes(content)
        assert any(fault in found for found in judge.judge_kill(place, known)), name
        (root / name).unlink() if before is None else (root / name).write_bytes(before)
    masks = {"shadow_mask.png": (b"old", b"new")}
    assert judge.judge_kill(place, known, masks) == ["shadow_mask.png is neither the old mask nor a new one"]
    (root / "notes" / "list.txt").unlink()
    assert "the user's notes/list.txt is gone" in judge.judge_kill(place, known)


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        (".scan.1.tmp.ply", "is left"),
        ("lock.succeeding", "is left"),
        ("kept/frames/00000.jpg", "nobody changed it"),
        ("../stray.txt", "lies beside"),
        ("lock", "the lock is not free"),
        ("frames/00000.jpg", "frames/00000.jpg is not as in the undisturbed run"),
    ],
)
def test_the_judge_finds_what_is_left_after_the_run_that_goes_on(place, undisturbed, name, fault):
    path = capture_at(place).root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")
    found = judge.judge_resume(place, undisturbed, "cameras")
    assert any(fault in each for each in found) and "the stage cameras is not on record" in found


@pytest.mark.parametrize(
    "moment", [worker.Moment(after_s=0.3), worker.Moment(write=3), worker.Moment(write=3, late_s=0.05)], ids=str
)
def test_a_process_is_struck_at_its_moment(tmp_path, moment):
    def work() -> None:
        for number in range(1000):
            (tmp_path / f"{number}.txt").write_text("x")
            time.sleep(0.02)

    forked = worker.Forked(work, tmp_path, tmp_path / "told", moment)
    assert forked.strike() and forked.code == -signal.SIGKILL
    written = len(list(tmp_path.glob("*.txt")))
    assert written == 2 if moment.write and not moment.late_s else 2 < written < 100
    never = worker.Forked(lambda: None, tmp_path, tmp_path / "told", worker.Moment(write=1))
    assert never.strike() is False


def test_a_process_may_be_struck_as_soon_as_it_is_there(tmp_path):
    for _ in range(20):
        forked = worker.Forked(lambda: time.sleep(60), tmp_path, tmp_path / "told", worker.Moment(after_s=0.0))
        assert forked.strike() and forked.code == -signal.SIGKILL


def test_a_camera_model_that_did_not_fit_on_the_disk_gets_no_name(tmp_path):
    """pycolmap writes what fits, and says nothing of the rest."""
    model = pycolmap.Reconstruction()
    for number in range(1, 20):
        model.add_camera_with_trivial_rig(
            pycolmap.Camera(camera_id=number, model="PINHOLE", width=720, height=960, params=[900, 900, 360, 480])
        )
        model.add_image_with_trivial_frame(
            pycolmap.Image(name=f"{number:05d}.jpg", camera_id=number, image_id=number), pycolmap.Rigid3d(np.eye(4)[:3])
        )
    cameras = tmp_path / "cameras"

    def attempt() -> None:
        with replacing_folder(cameras) as folder:
            write_model(folder, model)

    for most_bytes in (0, 7, 100, 1000):
        assert "disk is full" in with_limit(most_bytes, attempt)
        assert os.listdir(tmp_path) == []
    assert with_limit(1 << 20, attempt) == "" and len(read_model(cameras).cameras) == 19
    assert set(os.listdir(cameras)) == {f"{name}.bin" for name in ("cameras", "images", "points3D", "rigs", "frames")}


def test_a_checkpoint_that_did_not_fit_on_the_disk_is_told_by_name(tmp_path, monkeypatch):
    """safetensors has an error of its own, with the system's in words."""
    state = State(1, None, torch.ones(1, 7, 32, 32), Lights(*torch.ones(3, 4)), [])
    path = tmp_path / "solve.safetensors"
    assert (
        "solve.safetensors could not be written" in with_limit(4096, lambda: checkpoint.write_state(path, state, "key"))
        and os.listdir(tmp_path) == []
    )
    assert with_limit(1 << 20, lambda: checkpoint.write_state(path, state, "key")) == ""
    assert checkpoint.read_state(path, "key").step == 1

    def full(*_, **__):
        raise SafetensorError("Error while serializing: I/O error: No space left on device (os error 28)")

    monkeypatch.setattr(checkpoint, "save_file", full)
    with pytest.raises(Problem, match="disk is full"):
        checkpoint.write_state(path, state, "key")


def with_limit(most_bytes: int, attempt) -> str:
    """Problem of an attempt, in a process of its own in which no file may be longer; '' for none."""

    def work() -> str:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
        try:
            attempt()
        except Problem as problem:
            return problem.problem
        return ""

    return worker.in_fork(work)
