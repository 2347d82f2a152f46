# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A bad video and a cancel in the real frames and cameras stages: the capture can be used again."""

import json
import sys
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.messages import Cancelled, Done, Failed, Progress
from core.worker.client import Worker
from core.worker.job import write_job
from core.worker.runner import run_job
from tests.fixtures import tiny_chain
from tests.fixtures.tiny_chain import finished, follow

ROOT = Path(__file__).resolve().parents[3]
SAMPLE = ROOT / "research" / "people" / "sample" / "capture.mp4"


@pytest.fixture(scope="module")
def face(tmp_path_factory) -> Path:
    """A video of six frames of a face that wanders."""
    crops = [astronaut()[5 + 2 * k : 225 + 2 * k, 100 + 6 * k : 340 + 6 * k] for k in range(6)]
    return video(tmp_path_factory.mktemp("Vidéos d'été") / "Chloé (1).mp4", crops)


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Übung, 2. Mal 🙂" / "Chloé's face.wildcap")


def video(path: Path, pictures) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(24))
        stream.height, stream.width, stream.pix_fmt = *pictures[0].shape[:2], "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        container.mux(stream.encode())
    return path


def test_bad_input_is_refused_and_the_capture_takes_a_good_video_then(capture, face, tmp_path):
    bad = tmp_path / "source.mp4"
    bad.write_bytes(face.read_bytes()[: face.stat().st_size // 3])  # the index of an MP4 is at its end
    final = run_job(write_job(capture, source=bad, last="frames"))
    assert isinstance(final, Failed) and "source.mp4" in final.problem
    assert not capture.frames.exists() and not capture.lock.exists() and not list(capture.root.glob(".*"))
    assert isinstance(run_job(write_job(capture, source=face, last="frames")), Done) and capture.source == face
    assert len(json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"]) == 6


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    """The code as it is, but that workers keep their priority beside other tests."""
    core = tmp_path_factory.mktemp("code") / "core"
    tiny_chain.copy_ground(core)
    tiny_chain.set_nice(core.parent, 0)
    for room in {path.name for path in (ROOT / "core").iterdir()} - {*tiny_chain.GROUND, "__pycache__"}:
        (core / room).symlink_to(ROOT / "core" / room)
    return core.parent


@pytest.mark.skipif(not SAMPLE.is_file(), reason="the sample video is not in this checkout")
def test_a_cancel_in_the_cameras_stage_keeps_the_frames(root, capture):
    """COLMAP runs in a process of its own and hears of nothing for seconds: it ends with the worker, and soon."""
    job = {"last": "cameras", "settings": {"frames": {"max_frames": 8, "long_side": 320}}}
    assert isinstance(run_job(write_job(capture, source=SAMPLE, **{**job, "last": "frames"})), Done)
    frames = {path.name: path.read_bytes() for path in capture.frames.iterdir()}
    worker = Worker(Path(sys.executable), root, write_job(capture, **job), capture.logs / "worker.log")
    worker.start()
    messages = follow(worker, lambda m: isinstance(m, Progress) and m.stage == "cameras" and m.done > 0, timeout_s=120)
    assert finished(messages) == {"frames": True}
    began = time.monotonic()
    worker.cancel()
    assert follow(worker)[-1] == Cancelled("cameras") and time.monotonic() - began < 2
    assert {path.name: path.read_bytes() for path in capture.frames.iterdir()} == frames
    assert not capture.cameras.exists() and not capture.lock.exists()
