# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker, its installation and the capture's folder say when they cannot go on, where no other file tests it
already."""

import errno
import json
import sys
import time
from pathlib import Path

import pytest

from core.capture.capture import Capture
from core.capture.files import storage_problem
from core.capture.messages import Done, Failed, Problem
from core.worker import installation
from core.worker.job import read_job, write_job
from core.worker.locks import Lock
from core.worker.pip_steps import PipStep
from core.worker.runner import explained, run_job
from tests.fixtures.recorded import make_entry

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


@pytest.fixture
def capture(tmp_path) -> Capture:
    found = Capture(tmp_path / "Mon visage é.wildcap")
    found.root.mkdir()
    return found


def ended(capture: Capture, **job) -> str:
    """The problem of a job that is run in this very process."""
    final = run_job(write_job(capture, **job))
    assert isinstance(final, Failed) and final.remedy, final
    return final.problem


def test_a_job_without_its_source(capture, tmp_path):
    assert ended(capture) == "This capture has no video yet."
    assert "no video or folder at" in ended(capture, source=tmp_path / "none.mp4")


def test_a_job_over_another_source_than_before(capture, tmp_path):
    for name in ("a.mp4", "b.mp4"):
        (tmp_path / name).write_bytes(name.encode() * 9)
    capture.set_source(tmp_path / "a.mp4")
    record = capture.read()
    record["stages"]["frames"] = make_entry()
    capture.json.write_text(json.dumps(record), encoding="utf-8")
    assert "made from a.mp4, not from this b.mp4" in ended(capture, source=tmp_path / "b.mp4")


def test_a_job_for_a_device_that_is_not_here(capture):
    torch = pytest.importorskip("torch")
    device = "cuda" if not torch.cuda.is_available() else "mps"
    assert f"no device {device}" in ended(capture, first="solve", settings={"device": device})


def test_job_files_that_make_no_sense(capture, tmp_path):
    with pytest.raises(Problem, match="comes after"):
        write_job(capture, first="solve", last="frames")
    (tmp_path / "job.json").write_text("{", encoding="utf-8")
    with pytest.raises(Problem, match="cannot be read"):
        read_job(tmp_path / "job.json")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "not enough memory for the stage solve"),
        (ModuleNotFoundError("No module named 'x'", name="x"), "has no module named x"),
        (ZeroDivisionError("division by zero"), "ZeroDivisionError: division by zero)."),
        (OSError(errno.ENOSPC, "No space left on device", "/disk/x.exr"), "The disk is full"),
        (OSError(errno.EROFS, "Read-only file system", "/disk/x.exr"), "the folder is read-only"),
        (OSError(errno.EIO, "Input/output error", "/disk/x.exr"), "could not be written (Input/output error)"),
    ],
)
def test_what_stops_a_stage_is_explained(tmp_path, error, words):
    problem = explained(error, "solve", tmp_path / "solve.log")
    assert words in problem.problem and problem.remedy.endswith(".")


def test_a_write_is_named_by_the_file_it_was_for():
    assert (
        "maps"
        in storage_problem(
            OSError(errno.EACCES, "Permission denied"), Path("/face.wildcap/.maps.123.tmp/normal.png")
        ).problem
    )


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            "ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device",
            "The disk that holds",
        ),
        ("ERROR: Connection reset by peer", "could not be downloaded"),
        ("ERROR: It is Tuesday.", "The installation stopped (It is Tuesday)."),
        ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE.", "its hash is another"),
        ("Killed", "The installation stopped (no message)."),
    ],
)
def test_an_installation_that_stops_says_why(tmp_path, monkeypatch, said, words):
    monkeypatch.setattr(installation, "lock_of", lambda *_: Lock("manylinux_x86_64-3.11", {}))
    monkeypatch.setattr(installation.bare_environment, "make", lambda *_, **__: None)
    monkeypatch.setattr(installation, "plan_steps", lambda *_: [PipStep((said,))])

    def run(task, command, hear):
        hear(said)
        return 1, said if "ERROR" in said else ""

    monkeypatch.setattr(installation.BackgroundTask, "run", run)
    task = installation.installation(
        tmp_path / "env", REQUIREMENTS, tmp_path / "env.log", Path(sys.executable), installation.PackageSource()
    )
    assert words in finish(task).problem and said in (tmp_path / "env.log").read_text()


def test_a_machine_without_a_python_to_begin_with(monkeypatch):
    monkeypatch.setattr(installation, "answer", lambda *_: "")
    with pytest.raises(Problem, match="does not answer"):
        installation.base_python()


def finish(task) -> Failed | Done:
    task.start()
    messages, deadline = [], time.monotonic() + 30
    while task.running and time.monotonic() < deadline:
        messages += task.poll()
        time.sleep(0.01)
    return messages[-1]


def test_a_job_file_that_asks_for_what_cannot_be_is_named(tmp_path):
    (tmp_path / "job.json").write_text('{"capture": ".", "source": "", "settings": {"registration": -1}}')
    with pytest.raises(Problem, match="job.json cannot be used: The settings of the stage registration have to be"):
        read_job(tmp_path / "job.json")
