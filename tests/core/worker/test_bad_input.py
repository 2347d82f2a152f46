# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Input and disks that would lose work, through the command line and the real stages: one sentence, one remedy, exit
code 2.

Where kill -9 strikes: here in the real frames and cameras stages; test_worker.py kills every stage of the chain, over
tiny rooms.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.messages import Cancelled, Failed, Progress, StageDone
from core.worker.client import Worker
from core.worker.job import write_job
from tests.fixtures.tiny_chain import follow

ROOT = Path(__file__).resolve().parents[3]
SAMPLE = ROOT / "research" / "people" / "sample" / "capture.mp4"
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def face(tmp_path_factory) -> Path:
    """Twelve frames of a face that wanders."""
    crops = [astronaut()[5 + k : 225 + k, 100 + 3 * k : 340 + 3 * k] for k in range(12)]
    return video(tmp_path_factory.mktemp("Vidéos d'été") / "Chloé (1).mp4", crops)


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Übung, 2. Mal" / "Chloé's face.wildcap")


def video(path: Path, pictures) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(24))
        stream.height, stream.width, stream.pix_fmt = *pictures[0].shape[:2], "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        container.mux(stream.encode())
    return path


def run(source, capture: Capture, *options, within=()) -> subprocess.CompletedProcess:
    command = [
        *within,
        sys.executable,
        "-B",
        "-m",
        "core",
        "run",
        str(source),
        str(capture.root),
        "--until",
        "frames",
        *options,
    ]
    return subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=120)


def refused(source, capture: Capture, *words: str) -> None:
    """Two lines, code 2, no traceback, no frames, and the capture can be used again."""
    result = run(source, capture)
    lines = result.stderr.strip().splitlines()
    assert result.returncode == 2, result.stderr
    assert len(lines) == 2 and all(line.endswith(".") for line in lines), result.stderr
    assert "Traceback" not in result.stdout + result.stderr
    assert any(word in lines[0] for word in words), lines[0]
    assert not capture.frames.exists() and not capture.lock.exists() and not list(capture.root.glob(".*"))


def test_no_video(capture, tmp_path):
    refused(tmp_path / "none.mp4", capture, "There is no video")


def test_a_folder_without_pictures(capture, tmp_path):
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", capture, "photograph", "picture")


def test_text_called_mp4(capture, tmp_path):
    (tmp_path / "notes.mp4").write_text("Dear diary, no face today.\n" * 100)
    refused(tmp_path / "notes.mp4", capture, "notes.mp4")


def test_a_truncated_video(capture, face, tmp_path):
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(face.read_bytes()[: len(face.read_bytes()) // 3])  # the index of an MP4 is at its end
    refused(cut, capture, "cut.mp4")


def test_a_video_without_a_face(capture, tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (30, 40, 3), np.uint8)
    refused(
        video(tmp_path / "wall.mp4", [np.kron(np.roll(noise, k, 1), np.ones((8, 8, 1), np.uint8)) for k in range(8)]),
        capture,
        "face",
    )


def test_a_video_that_stands_still(capture, tmp_path):
    refused(video(tmp_path / "still.mp4", [astronaut()[0:220, 100:340]] * 8), capture, "same", "still", "move")


def test_the_same_capture_takes_a_good_video_after_a_bad_one(capture, face, tmp_path):
    (tmp_path / "notes.mp4").write_text("no video")
    refused(tmp_path / "notes.mp4", capture, "notes.mp4")
    result = run(face, capture)
    assert result.returncode == 0, result.stderr
    assert len(json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"]) == 12


def test_accents_and_spaces_in_every_path(face, tmp_path):
    """Also in the path of the code itself, as in C:/Users/Chloé Müller."""
    root = tmp_path / "Chloé Müller" / "wild cap"
    shutil.copytree(
        ROOT / "core",
        root / "core",
        ignore=shutil.ignore_patterns("__pycache__", "sample_head"),
    )
    capture = Capture(tmp_path / "mes visages" / "été 🙂.wildcap")
    command = [sys.executable, "-B", "-m", "core", "run", str(face), str(capture.root), "--until", "frames"]
    result = subprocess.run(command, cwd=root, env=ENVIRONMENT, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    assert capture.has("frames/") and capture.source == face


# -- disks


def private_mounts() -> bool:
    if shutil.which("unshare") is None:
        return False
    return subprocess.run(["unshare", "-rm", "true"], capture_output=True).returncode == 0


needs_mounts = pytest.mark.skipif(not private_mounts(), reason="needs a mount namespace of its own (Linux, unshare)")


@needs_mounts
def test_a_full_disk_is_told_and_nothing_is_lost(face, tmp_path):
    """A disk of 200 kB: it stops in the middle of the frames. With more space the same command goes through, and the
    mask is still there."""
    disk = tmp_path / "Disque plein"
    disk.mkdir()
    command = f'"{sys.executable}" -B -m core run "{face}" "{disk}/a.wildcap" --until frames'
    script = f"""
        mount -t tmpfs -o size=200k tmpfs "{disk}" && mkdir "{disk}/a.wildcap"
        printf '{{"format": 2, "source": "", "stages": {{}}}}' > "{disk}/a.wildcap/capture.json"; echo painted > "{disk}/a.wildcap/shadow_mask.png"
        {command} >/dev/null; echo "code $?"
        ls -A "{disk}/a.wildcap" | grep -c tmp
        mount -o remount,size=50m "{disk}"
        {command} >/dev/null; echo "code $?"
        cat "{disk}/a.wildcap/shadow_mask.png"; ls "{disk}/a.wildcap/frames" | grep -c jpg
    """
    result = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script], cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )
    assert result.stdout.split("\n")[:5] == ["code 2", "0", "code 0", "painted", "12"], result
    problem, remedy = result.stderr.strip().splitlines()
    assert problem.startswith("The disk is full") and remedy.endswith(".")


@needs_mounts
def test_a_read_only_folder_is_told(face, tmp_path):
    """A mount, because the permissions of a folder do not bind root."""
    folder = tmp_path / "Lecture seule"
    folder.mkdir()
    script = f"""
        mount --bind "{folder}" "{folder}" && mount -o remount,bind,ro "{folder}"
        "{sys.executable}" -B -m core run "{face}" "{folder}/a.wildcap" --until frames; echo "code $?"
    """
    result = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script], cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )
    assert result.stdout.strip() == "code 2", result
    problem, remedy = result.stderr.strip().splitlines()
    assert "read-only" in problem and remedy.endswith(".")


# -- kill -9 and cancel in real stages


def start(source, capture: Capture, **job) -> Worker:
    capture.root.mkdir(parents=True, exist_ok=True)
    worker = Worker(Path(sys.executable), ROOT, write_job(capture, source=source, **job), capture.logs / "worker.log")
    worker.start()
    return worker


def working(stage: str):
    return lambda message: isinstance(message, Progress) and message.stage == stage and message.done > 0


def test_kill_in_the_frames_stage_and_resume(capture, face):
    worker = start(face, capture, last="frames")
    follow(worker, until=working("frames"), timeout_s=60)
    worker._process.kill()
    assert isinstance(follow(worker)[-1], Failed)
    assert not capture.frames.exists()
    result = run("-", capture)
    assert result.returncode == 0, result.stderr
    assert len(list(capture.frames.glob("*.jpg"))) == 12 and not list(capture.root.glob(".*"))


@pytest.mark.skipif(not SAMPLE.is_file(), reason="the sample video is not in this checkout")
def test_kill_and_cancel_in_the_cameras_stage_keep_the_frames(capture):
    """COLMAP runs in a process of its own and hears of nothing for seconds: both must end it, and soon."""
    job = {"last": "cameras", "settings": {"frames": {"max_frames": 16, "long_side": 480}}}
    worker = start(SAMPLE, capture, **job)
    follow(worker, until=working("cameras"), timeout_s=120)
    kept = {path.name: path.read_bytes() for path in capture.frames.iterdir()}
    worker._process.kill()
    assert isinstance(follow(worker)[-1], Failed)
    worker = start(SAMPLE, capture, **job)
    messages = follow(worker, until=working("cameras"), timeout_s=120)
    assert [(m.stage, m.skipped) for m in messages if isinstance(m, StageDone)] == [("frames", True)]
    asked = time.monotonic()
    worker.cancel()
    assert follow(worker)[-1] == Cancelled("cameras") and time.monotonic() - asked < 2
    assert {path.name: path.read_bytes() for path in capture.frames.iterdir()} == kept
    assert not capture.cameras.exists() and not capture.lock.exists()
