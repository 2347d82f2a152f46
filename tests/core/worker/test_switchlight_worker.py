# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""SwitchLight in a job of its own process: killed in the middle, continued without paying twice, and no key in anything
a run leaves; and its flags."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.__main__ import main
from core.capture import consent
from core.capture import switchlight_api as service
from core.capture.capture import Capture
from core.capture.messages import Done
from core.worker.job import write_job
from core.worker.runner import run_job
from tests.fixtures.switchlight_capture import make
from tests.fixtures.switchlight_server import KEY, Service

ROOT = Path(__file__).resolve().parents[3]
STAGE = ["--from", "delight", "--until", "delight", "--delighter", "switchlight"]
JOB = [
    sys.executable,
    "-B",
    "-c",
    "import sys, pathlib; from core.worker.runner import run_job; print(run_job(pathlib.Path(sys.argv[1]), print))",
]
"""What the worker does, at the priority of a test and without the pipe that would tell it of its starter's end."""


@pytest.fixture
def capture(tmp_path):
    Capture(tmp_path / "Zoë.wildcap").claim()
    capture = make(tmp_path / "Zoë.wildcap", 6, 6)
    capture.head.write_text("v 0 0 0\n", encoding="ascii")
    capture.set_source("")
    return capture


def begin(job: Path, server: Service, **more) -> subprocess.Popen:
    environment = {**os.environ, service.KEY_VARIABLE: KEY, service.BASE_VARIABLE: server.url, **more}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "encoding": "utf-8"}
    return subprocess.Popen([*JOB, str(job)], cwd=ROOT, env=environment, **pipes)


def command_lines() -> list[bytes]:
    """Those of all processes that can be looked at."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(path.read_bytes())
        except OSError:
            pass
    return found


def test_killed_in_the_middle_and_continued_each_frame_is_paid_once_and_the_key_is_nowhere(capture, monkeypatch):
    for name in (consent.GIVEN_VARIABLE, service.OFFLINE_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    job = write_job(capture, first="delight", last="delight", settings={"delight": {"delighter": "switchlight"}})
    with Service(["fine", "fine", "fine", *["hang"] * 3]) as server:
        with begin(job, server, **consent.by_flag(capture)) as first:
            end = time.monotonic() + 60
            while len(server.calls) < 6 or len(list(capture.switchlight.glob("[!.]*.png"))) < 3:
                assert time.monotonic() < end and first.poll() is None, first.communicate()
                time.sleep(0.02)
            assert not any(KEY.encode() in line for line in command_lines())
            first.kill()
            said = first.communicate()[0]
        said += (capture.logs / "delight.log").read_text(encoding="utf-8")
        assert "6 credits" in said and sorted(server.charged.values()) == [1, 1, 1] and capture.lock.is_file()
        for name, value in (("KEY_VARIABLE", KEY), ("BASE_VARIABLE", server.url)):
            monkeypatch.setenv(getattr(service, name), value)
        messages: list = []
        assert isinstance(run_job(job, messages.append), Done), messages
        said += f"{messages} {(capture.logs / 'delight.log').read_text(encoding='utf-8')}"
        assert len(server.charged) == 6 and set(server.charged.values()) == {1}, (
            "and the consent holds for what is left"
        )
        assert "with 3 credits." in said and "3 more have their answer already" in said
        left = [path for path in capture.root.rglob("*") if path.is_file()]
        names = {path.name for path in left}
        assert {"capture.json", "job.json", "consent.json", "report.html", "delight.log"} <= names
        assert not [path for path in left if KEY.encode() in path.read_bytes()] and KEY not in said


def test_the_flags_go_with_switchlight_alone(capture, capsys):
    for flag in ("--send-frames", "--preview"):
        assert main(["run", "-", str(capture.root), flag]) == 2
        assert "go with --delighter switchlight" in capsys.readouterr().err
    assert not capture.consent.exists()


def test_the_flag_reaches_the_worker_by_its_environment_alone(capture, capsys, monkeypatch):
    from core.worker import terminal

    followed = []
    monkeypatch.setattr(terminal, "follow", lambda *arguments: followed.append(arguments) or 0)
    assert main(["run", "-", str(capture.root), *STAGE, "--send-frames", "--preview"]) == 0
    assert main(["run", "-", str(capture.root), *STAGE]) == 0
    assert followed[0][3] == {consent.GIVEN_VARIABLE: str(capture.root.resolve())} and followed[1][3] == {}
    assert consent.GIVEN_VARIABLE not in capture.job.read_text(encoding="utf-8") and not capture.consent.exists()
