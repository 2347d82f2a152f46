# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A cancel in the real stage of cameras."""

import sys
import time
from pathlib import Path

import pytest

from core.capture.capture import Capture
from core.capture.messages import Cancelled, Done, Progress
from core.worker.client import Worker
from core.worker.job import write_job
from core.worker.runner import run_job
from tests.fixtures import tiny_chain
from tests.fixtures.tiny_chain import finished, follow

ROOT = Path(__file__).resolve().parents[3]
SAMPLE = ROOT / "research" / "people" / "sample" / "capture.mp4"


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Übung, 2. Mal 🙂" / "Chloé's face.wildcap")


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
