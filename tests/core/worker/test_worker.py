# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker and its client: however a job ends, it ends in one message, and what was finished is kept.

The worker is the real one; the rooms are tiny (tiny_chain.py), so that every stage can be killed in seconds.
test_bad_input.py does the same to the real frames stage.
"""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Cancelled, Done, Failed, Log, Problem, Progress, StageDone
from core.capture.report import findings
from core.worker.client import GRACE_S, Worker
from tests.fixtures import tiny_chain
from tests.fixtures.tiny_chain import contents, follow, start


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    return tiny_chain.build(tmp_path_factory.mktemp("Erweiterung für mich"))


@pytest.fixture
def video(tmp_path) -> Path:
    path = tmp_path / "Vidéo de l'été.mp4"
    path.write_bytes(b"stands in for a video")
    return path


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Mon visage é.wildcap")


def finished(messages) -> dict[str, bool]:
    """Stage -> whether it was skipped."""
    return {m.stage: m.skipped for m in messages if isinstance(m, StageDone)}


def leftovers(capture: Capture) -> list[Path]:
    return [path for path in capture.root.rglob(".*")] + [capture.lock] * capture.lock.exists()


def test_a_job_runs_every_stage_in_order_and_a_second_run_skips_them(root, capture, video):
    messages = follow(start(root, capture, source=video))
    assert list(finished(messages)) == list(stages.NAMES) and not any(finished(messages).values())
    assert isinstance(messages[-1], Done)
    assert capture.read()["stages"]["solve"]["figures"] == {"size_px": 64}
    assert "4K Maps" in capture.report.read_text(encoding="utf-8")
    before = contents(capture)
    messages = follow(start(root, capture))
    assert all(finished(messages).values()) and isinstance(messages[-1], Done)
    assert contents(capture) == before and not leftovers(capture)


def test_from_forces_and_until_ends(root, capture, video):
    follow(start(root, capture, source=video, last="texture"))
    again = finished(follow(start(root, capture, first="scan", last="delight")))
    assert again == {"scan": False, "registration": False, "delight": False}
    rest = finished(follow(start(root, capture, last="shadow_mask")))
    assert rest == {**dict.fromkeys(stages.NAMES[:6], True), "shadow_mask": False}


def test_a_stage_without_its_inputs_is_refused(root, capture, video):
    final = follow(start(root, capture, source=video, first="solve"))[-1]
    assert isinstance(final, Failed) and final.stage == "solve" and "texture.exr" in final.problem


def test_killed_in_stage_after_stage_the_chain_loses_that_stage_at_most(root, capture, video, tmp_path):
    for i, name in enumerate((*stages.NAMES, None)):
        worker = start(root, capture, {name: "slow"}, source=video)
        messages = follow(worker, until=lambda m: isinstance(m, Progress) and m.text == "half written")
        # all but the stage that was killed before this one are there, and that one is done again
        assert finished(messages) == {done: done != stages.NAMES[i - 1] for done in stages.NAMES[:i]}, name
        if name is not None:
            worker._process.kill()
            final = follow(worker)[-1]
            assert isinstance(final, Failed) and final.stage == name and str(capture.logs) in final.remedy
    assert isinstance(messages[-1], Done) and not leftovers(capture)
    unharmed = Capture(tmp_path / "unharmed.wildcap")
    follow(start(root, unharmed, source=video))
    assert contents(capture) == contents(unharmed)


def test_a_killed_rerun_is_not_taken_for_the_old_result(root, capture, video):
    """Killed after the new output is in place and before it is recorded: the old record must not vouch for it."""
    follow(start(root, capture, source=video))
    worker = start(root, capture, {"texture": "slow"}, first="texture", settings={"texture": {"size": 512}})
    follow(worker, until=lambda m: isinstance(m, Progress) and m.text == "half written")
    worker.terminate()
    follow(worker)
    assert not finished(follow(start(root, capture)))["texture"]


@pytest.mark.parametrize(("mood", "limit_s"), [("slow", 1.0), ("deaf", 2.0)])
def test_cancel_ends_within_two_seconds(root, capture, video, mood, limit_s):
    worker = start(root, capture, {"cameras": mood}, source=video)
    follow(worker, until=lambda m: isinstance(m, Progress) and m.stage == "cameras" and m.done == 3)
    time.sleep(0.05)
    asked = time.monotonic()
    worker.cancel()
    final = follow(worker)[-1]
    assert final == Cancelled("cameras")
    assert time.monotonic() - asked < limit_s and (mood == "slow" or time.monotonic() - asked > GRACE_S)
    assert finished(follow(start(root, capture, last="cameras"))) == {"frames": True, "cameras": False}
    assert not leftovers(capture)


def test_the_worker_ends_when_its_starter_is_gone(root, capture, video):
    worker = start(root, capture, {"frames": "deaf"}, source=video)
    follow(worker, until=lambda m: isinstance(m, Progress))
    worker._process.stdin.close()
    assert worker._process.wait(timeout=5) == 3


@pytest.mark.parametrize(
    ("mood", "problem"),
    [
        ("finding", "The face is not there."),
        ("bug", "An error inside WildCap stopped the stage scan (WC-"),
        ("memory", "There was not enough memory for the stage scan."),
        ("full", "The disk is full"),
        ("module", "The solver's Python has no module named a_module_that_is_not_there"),
        ("nothing", "An error inside WildCap stopped the stage scan (WC-"),
        ("die", "The worker ended unexpectedly during the stage scan (exit code 9)."),
    ],
)
def test_every_way_to_fail_is_a_problem_with_a_remedy(root, capture, video, mood, problem):
    final = follow(start(root, capture, {"scan": mood}, source=video))[-1]
    assert isinstance(final, Failed) and final.stage == "scan" and final.problem.startswith(problem)
    assert final.remedy.endswith((".", ".log")) and "Traceback" not in final.problem + final.remedy
    assert [f["problem"] for f in findings(capture.read())] == ([final.problem] if mood == "finding" else [])
    if mood == "bug":
        log = (capture.logs / "scan.log").read_text(encoding="utf-8")
        assert "Traceback" in log and "ZeroDivisionError" in log and str(capture.logs / "scan.log") in final.remedy
        assert re.search(r"WC-[0-9a-f]{6}", final.problem)[0] in log
    assert finished(follow(start(root, capture, last="scan"))) == {"frames": True, "cameras": True, "scan": False}


def test_what_libraries_print_goes_to_the_log_and_not_into_the_protocol(root, capture, video):
    messages = follow(start(root, capture, {"frames": "print"}, source=video, last="frames"))
    assert isinstance(messages[-1], Done) and not any(isinstance(m, Log) for m in messages)
    log = (capture.logs / "frames.log").read_text(encoding="utf-8")
    assert "a library talks" in log and "{raw bytes" in log


def test_a_second_worker_is_refused_by_name(root, capture, video):
    first = start(root, capture, {"frames": "slow"}, source=video)
    follow(first, until=lambda m: isinstance(m, Progress))
    asked = capture.job.read_bytes()
    with pytest.raises(Problem, match=str(first._process.pid)):
        start(root, capture, {"frames": "slow"})
    assert capture.job.read_bytes() == asked, "the record of what the first was asked stays"
    late = Worker(Path(sys.executable), root, capture.job, capture.logs / "late.log")  # as by two who wrote at once
    late.start()
    refused = follow(late)[-1]
    assert isinstance(refused, Failed) and str(first._process.pid) in refused.problem
    assert first.running, "the first worker is not disturbed"
    first.terminate()
    follow(first)
    assert isinstance(follow(start(root, capture))[-1], Done), "the lock of the dead is taken over"


def test_a_video_that_is_gone_is_missed_only_until_its_frames_are_taken(root, capture, video):
    aside = video.with_suffix(".aside")
    video.rename(aside)
    final = follow(start(root, capture, source=video))[-1]
    assert isinstance(final, Failed) and str(video) in final.problem
    aside.rename(video)
    follow(start(root, capture, source=video, last="cameras"))
    video.unlink()
    messages = follow(start(root, capture, source=video))
    assert isinstance(messages[-1], Done) and finished(messages)["frames"]
    assert isinstance(follow(start(root, capture, first="frames"))[-1], Failed)


def test_another_video_does_not_slip_into_a_capture(root, capture, video):
    follow(start(root, capture, source=video, last="frames"))
    other = video.with_name("other.mp4")
    other.write_bytes(b"another face")
    final = follow(start(root, capture, source=other))[-1]
    assert isinstance(final, Failed) and video.name in final.problem and "other.mp4" in final.problem
    assert isinstance(follow(start(root, capture, source=other, first="frames"))[-1], Done)


def test_no_device_is_invented(capture, video):
    with pytest.raises(Problem, match="device is 'abacus'.*auto, cpu, cuda, mps"):
        tiny_chain.write_job(capture, source=video, settings={"device": "abacus"})


def test_a_damaged_job_file_and_a_python_that_is_none_are_told(root, capture):
    capture.logs.mkdir(parents=True)
    capture.job.write_text("{", encoding="utf-8")
    worker = Worker(Path(sys.executable), root, capture.job, capture.logs / "worker.log")
    worker.start()
    assert "job file" in follow(worker)[-1].problem
    with pytest.raises(Problem, match="could not be started"):
        Worker(capture.root / "no python", root, capture.job, capture.logs / "worker.log").start()


@pytest.mark.skipif(os.name != "posix", reason="priorities are read through ps")
def test_the_worker_steps_back_behind_blender(root, capture, video):
    worker = start(root, capture, {"frames": "slow"}, source=video)
    follow(worker, until=lambda m: isinstance(m, Progress))
    assert os.getpriority(os.PRIO_PROCESS, worker._process.pid) > os.getpriority(os.PRIO_PROCESS, 0)
    group = Path(f"/proc/{worker._process.pid}/autogroup")
    if group.exists():  # Linux shares the processor between sessions before it looks at nice values
        assert int(group.read_text().split()[-1]) > 0
    environment = Path(f"/proc/{worker._process.pid}/environ")
    if environment.exists():
        assert b"OMP_NUM_THREADS=" in environment.read_bytes() and b"GOMP_SPINCOUNT=" in environment.read_bytes()
    worker.terminate()
    assert isinstance(follow(worker)[-1], Cancelled)


def test_poll_never_waits(root, capture, video):
    worker = start(root, capture, {"frames": "deaf"}, source=video)
    started = time.monotonic()
    for _ in range(100):
        worker.poll()
    assert time.monotonic() - started < 0.1
    worker.terminate()
    follow(worker)


def test_only_protocol_lines_leave_by_stdout(root, capture, video):
    """Without the client: every line of the real stdout is a message, and stdin's end ends the worker."""
    capture.claim()
    (capture.root / "mood.json").write_text('{"frames": "print"}')
    job = tiny_chain.write_job(capture, source=video, last="frames")
    command = [sys.executable, "-E", "-s", "-B", "-m", "core.worker", str(job)]
    with subprocess.Popen(
        command,
        cwd=root,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        # it steps back with its whole session, which shall not be this one
        start_new_session=True,
    ) as process:
        lines = process.stdout.read().splitlines()
    assert [json.loads(line)["kind"] for line in lines][-2:] == ["StageDone", "Done"]
