# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A stranger's record cannot inject into the report, the key reaches only what sends, and only approved pixels are
sent."""

import functools
import json
import operator
import os
import sys

import pytest

from core.batch import task
from core.capture import consent, report, switchlight_api
from core.capture.capture import Capture
from core.capture.messages import Problem
from core.settings.settings import Settings
from core.worker import client, environment, terminal
from core.worker.background import BackgroundTask
from core.worker.job import write_job
from tests.fixtures import recorded
from tests.fixtures.refused import refuses

KEY = "sk-Zoe-4711-do-not-tell"
SCRIPT = '"><script>alert(1)</script>'


def leaves(value, way=()):
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield from leaves(value[key], (*way, key))
    if not isinstance(value, dict | list):
        yield way


def test_no_text_of_a_record_becomes_part_of_the_report_s_page(tmp_path):
    capture = recorded.make(tmp_path / "a.wildcap")
    whole = capture.read()
    finding = {"problem": "p", "remedy": "r", "frames": ["1"]}
    whole["stopped"] = {"stage": "scan", "problem": "p", "remedy": "r", "findings": [finding]}
    written = 0
    for way in leaves(whole):
        record = json.loads(json.dumps(whole))
        functools.reduce(operator.getitem, way[:-1], record)[way[-1]] = SCRIPT
        capture.json.write_text(json.dumps(record))
        try:
            report.write(capture, Settings())
        except Problem:
            continue
        written += 1
        assert "<script" not in capture.report.read_text(encoding="utf-8"), way
    assert written > 10


@pytest.fixture
def key(monkeypatch):
    monkeypatch.setenv(switchlight_api.KEY_VARIABLE, KEY)
    monkeypatch.setattr(switchlight_api, "_kept", "")


def test_the_key_goes_to_workers_that_send_and_to_nobody_else(key, tmp_path, monkeypatch):
    assert KEY not in client._environment({}).values()
    assert KEY in client._environment({switchlight_api.KEY_VARIABLE: KEY}).values()
    given = []
    monkeypatch.setattr(terminal, "Worker", lambda *arguments: given.append(arguments[-1]) or sys.exit())
    for delighter in ("network", "switchlight"):
        capture = Capture(tmp_path / f"{delighter}.wildcap")
        job = write_job(capture, settings={"delight": {"delighter": delighter}})
        with pytest.raises(SystemExit):
            terminal.follow(tmp_path, capture, job, {"A": "B"})
    assert given == [{"A": "B"}, {"A": "B", switchlight_api.KEY_VARIABLE: KEY}]
    heard = []
    show = [sys.executable, "-S", "-c", "import os; print(os.environ)"]
    background = BackgroundTask("try", lambda each: each.run(show, heard.append))
    background.start()
    background._thread.join()
    assert heard and KEY not in "".join(heard)


@pytest.mark.skipif(os.name == "nt", reason="a script is no program there")
def test_a_python_that_is_asked_and_a_blender_that_renders_do_not_inherit_the_key(key, tmp_path):
    answer = environment.answer(sys.executable, "import os; print(os.environ)")
    assert "PATH" in answer and KEY not in answer
    blender, capture = tmp_path / "blender", Capture(tmp_path / "a.wildcap")
    blender.write_text("#!/bin/sh\nenv\n")
    blender.chmod(0o755)
    refuses("no contact sheet", task._render_sheet, str(blender), capture, lambda message: None, lambda: False)
    told = (capture.logs / "contact_sheet.log").read_text()
    assert "PATH=" in told and KEY not in told


def test_what_a_worker_starts_does_not_inherit_the_key(key):
    switchlight_api.keep_key()
    assert switchlight_api.KEY_VARIABLE not in os.environ and switchlight_api.key() == KEY


def test_a_frame_that_changed_after_it_was_agreed_to_is_not_sent(tmp_path):
    capture = Capture(tmp_path / "a.wildcap")
    capture.frames.mkdir(parents=True)
    frame = capture.frames / "00000.jpg"
    frame.write_bytes(b"as it was shown")
    plan = consent.sending(capture, False, ["00000.jpg"])
    from core.stages.delight.switchlight import pack_frame

    assert pack_frame(capture, "00000.jpg", plan.frames["00000.jpg"], False).data == b"as it was shown"
    before = frame.stat()
    frame.write_bytes(b"as it is now...")
    os.utime(frame, ns=(before.st_atime_ns, before.st_mtime_ns))
    refuses("00000.jpg changed after you agreed", pack_frame, capture, "00000.jpg", plan.frames["00000.jpg"], False)
