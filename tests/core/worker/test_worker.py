# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker as a process, and its client: killed, cancelled or left alone, it ends in one message and keeps what was
finished. test_runner.py has how jobs end within the process."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Cancelled, Done, Failed, Progress
from core.worker import client
from core.worker.__main__ import NICE_VALUE
from core.worker.client import GRACE_S, Worker
from tests.fixtures import tiny_chain
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_chain import contents, finished, follow, start


@pytest.fixture
def video(tmp_path) -> Path:
    path = tmp_path / "Vidéo de l'été.mp4"
    path.write_bytes(b"stands in for a video")
    return path


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Mon visage é.wildcap")


def half_written(message) -> bool:
    return isinstance(message, Progress) and message.text == "half written"


def leftovers(capture: Capture) -> list[Path]:
    return [*capture.root.rglob(".*"), *[capture.lock] * capture.lock.exists()]


def test_killed_in_a_stage_the_chain_loses_that_stage_at_most(tiny_code, capture, video, tmp_path):
    killed = "frames", "registration", "texture", "solve"  # a folder, a file, several files, several files in a folder
    skipped: dict[str, bool] = {}
    for name in killed:
        worker = start(tiny_code, capture, {name: "slow"}, source=video)
        messages = follow(worker, until=half_written)
        skipped = {done: done in skipped for done in stages.NAMES[: stages.NAMES.index(name)]}
        assert finished(messages) == skipped, name
        worker._process.kill()
        final = follow(worker)[-1]
        assert isinstance(final, Failed) and final.stage == name
        assert "killed from outside" in final.problem and str(capture.logs) in final.remedy
    assert isinstance(follow(start(tiny_code, capture))[-1], Done) and not leftovers(capture)
    unharmed = Capture(tmp_path / "unharmed.wildcap")
    follow(start(tiny_code, unharmed, source=video))
    assert contents(capture) == contents(unharmed)


@pytest.mark.parametrize(("mood", "limit_s"), [("slow", 1.0), ("deaf", 2.0)])
def test_cancel_ends_within_two_seconds(tiny_code, capture, video, mood, limit_s):
    worker = start(tiny_code, capture, {"cameras": mood}, source=video)
    follow(worker, until=lambda m: isinstance(m, Progress) and m.stage == "cameras" and m.done == 3)
    time.sleep(0.05)
    began = time.monotonic()
    worker.cancel()
    assert follow(worker)[-1] == Cancelled("cameras")
    assert time.monotonic() - began < limit_s and (mood == "slow" or time.monotonic() - began > GRACE_S)
    assert finished(follow(start(tiny_code, capture, last="cameras"))) == {"frames": True, "cameras": False}
    assert not leftovers(capture)


def test_a_worker_steps_back_never_holds_its_starter_up_and_ends_with_it(tiny_code, capture, video, tmp_path):
    root = shutil.copytree(tiny_code, tmp_path / "code")
    tiny_chain.set_nice(root, NICE_VALUE)
    worker = start(root, capture, {"frames": "deaf"}, source=video)
    began = time.monotonic()
    for _ in range(100):
        worker.poll()
    assert time.monotonic() - began < 0.1
    follow(worker, until=lambda m: isinstance(m, Progress))
    process = worker._process.pid
    if os.name == "posix":
        assert os.getpriority(os.PRIO_PROCESS, process) > os.getpriority(os.PRIO_PROCESS, 0)
    group, environment = Path(f"/proc/{process}/autogroup"), Path(f"/proc/{process}/environ")
    if group.exists():  # Linux shares the processor between sessions before it looks at nice values
        assert int(group.read_text().split()[-1]) > 0
    if environment.exists():
        assert {b"OMP_NUM_THREADS=", b"GOMP_SPINCOUNT="} <= {
            each.partition(b"=")[0] + b"=" for each in environment.read_bytes().split(b"\0")
        }
    worker._process.stdin.close()
    assert worker._process.wait(timeout=5) == 3


def test_threads_leave_a_core_free_unless_the_user_has_set_them(monkeypatch):
    for name in client.THREAD_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    for cores, threads in ((1, "1"), (2, "2"), (8, "7")):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _, cores=cores: range(cores), raising=False)
        assert {client._environment({})[name] for name in client.THREAD_VARIABLES} == {threads}
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert client._environment({})["OMP_NUM_THREADS"] == "3"
    assert client._environment({"OMP_NUM_THREADS": "4"})["OMP_NUM_THREADS"] == "4"


def test_a_worker_that_dies_or_is_terminated_says_where(tiny_code, capture, video):
    worker = start(tiny_code, capture, {"scan": "die"}, source=video)
    final = follow(worker)[-1]
    assert isinstance(final, Failed) and final.stage == "scan" and "scan" in final.problem and "code 9" in final.problem
    assert worker.died and str(capture.logs / "scan.log") in final.remedy
    worker = start(tiny_code, capture, {"scan": "slow"})
    follow(worker, until=half_written)
    worker.terminate()
    assert follow(worker)[-1] == Cancelled("scan") and not worker.died


def test_a_python_that_is_none_is_told(tiny_code, capture):
    refuses(
        "could not be started",
        Worker(capture.root / "no python", tiny_code, capture.job, capture.logs / "worker.log").start,
    )


def test_only_protocol_lines_leave_by_stdout(tiny_code, capture, video):
    """Without the client: every line of the real stdout is a message, and stdin's end ends the worker."""
    tiny_chain.set_mood(capture, {"frames": "print"})
    job = tiny_chain.write_job(capture, source=video, last="frames")
    with subprocess.Popen(
        [sys.executable, "-E", "-s", "-B", "-m", "core.worker", str(job)],
        cwd=tiny_code,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # a worker lowers the priority of its whole session
    ) as process:
        lines = process.stdout.read().splitlines()
    assert [json.loads(line)["kind"] for line in lines][-2:] == ["StageDone", "Done"]
    log = (capture.logs / "frames.log").read_text(encoding="utf-8")
    assert "a library talks" in log and "{raw bytes" in log
