# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A report about a problem says what helps and nothing of who and where."""

import json
import zipfile
from pathlib import Path

import pytest

from core.__main__ import main
from core.capture import stages, unforeseen
from core.capture.capture import Capture
from core.settings.settings import from_json
from core.worker import problem_report
from core.worker.job import write_job
from core.worker.problem_report import REMOVED, Scrubber
from tests.fixtures import recorded

ROOT = Path(__file__).resolve().parents[3]
KEY = "sk-Zoe-4711-do-not-tell"


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    monkeypatch.setattr(problem_report, "_own_names", lambda: {"zoeann", "Zoes-MacBook", "Zoë Müller"})
    monkeypatch.setenv(problem_report.switchlight_api.KEY_VARIABLE, KEY)
    capture = recorded.make(tmp_path / "Zoë Müller" / "Tante Erna.wildcap")
    capture.logs.mkdir()
    return capture


SECRETS = ("Zoë", "Zoe\u0308", "Müller", "zoeann", "MacBook", "Erna", "Urlaub", "Sommer", "geheim", KEY, "film.mp4")
LINES = (
    'File "/home/zoeann/Sommer Urlaub/geheim.py", line 3, in run',
    "could not open /Users/zoeann/Sommer Urlaub (1).mov: No such file",
    "~/Sommer/Urlaub.mp4",
    r"C:\Users\Zoë Müller\Videos\Urlaub.mp4 is missing",
    r'{"path": "C:\\Users\\zoeann\\geheim"}',
    r"\\server\geheim\Urlaub.mp4",
    "file:///home/zoeann/geheim.jpg",
    "D:/Urlaub/geheim.png",
    "the frame of film.mp4 shows Tante Erna",
    "'/Volumes/Zoe\u0308s Disk/Urlaub.mov' [Errno 2]",
    f"x-api-key: {KEY}",
    "ZOEANN@Zoes-MacBook:~$",
)


def test_nothing_of_the_user_s_is_left_whatever_a_log_says(capture):
    scrub = Scrubber(ROOT, None, capture)
    for line in (*LINES, *map(repr, LINES), *map(json.dumps, LINES), f"{capture.root}/frames/geheim: {capture.source}"):
        said = scrub(line)
        assert not any(secret.lower() in said.lower() for secret in SECRETS), (line, said)


def test_no_name_of_what_the_settings_name_elsewhere_is_left(capture, tmp_path):
    """A figure tells the own head's name, and a problem that of another capture of the person."""
    (tmp_path / "lights" / "Jane Doe evening.wildcap").mkdir(parents=True)
    (tmp_path / "lights" / "Jane Doe evening.wildcap" / "capture.json").write_text("{}")
    chosen = from_json({"registration": {"template": str(tmp_path / "heads" / "jane_doe_bust.obj")}})
    figures = {"own_template": "jane_doe_bust"}
    capture.finish(stages.by_name("registration"), {"inputs": {}, "code": ""}, 1.0, chosen, figures, "0.2.0")
    write_job(capture, settings={"solve": {"together": str(tmp_path / "lights")}})
    scrub = Scrubber(ROOT, None, capture)
    assert scrub("the head jane_doe_bust.obj") == f"the head {REMOVED}"
    assert scrub("Jane Doe evening has no texture") == f"{REMOVED} has no texture"
    described = json.dumps(problem_report._described(capture))
    assert "jane_doe_bust" in described and "jane_doe" not in scrub(described)


def test_what_helps_stays(capture):
    scrub = Scrubber(ROOT, Path("/opt/solver/bin/python"), capture)
    trace = (
        f'  File "{ROOT}/core/stages/scan/stereo.py", line 31, in match\n    depth = 3/4 * focal  # '
        'and/or\nZeroDivisionError: division by zero'
    )
    assert scrub(trace) == trace.replace(str(ROOT), "<WildCap>")
    assert scrub(f"{capture.root}/frames/00001.jpg cannot be read") == "<capture>/frames/00001.jpg cannot be read"
    assert scrub("/opt/solver/lib/torch/x.py") == "<solver>/lib/torch/x.py"
    plain = "https://example.org/simple 12:30:05 2026-11-23 50% of 3/4"
    assert scrub(plain) == plain


def test_the_zip_holds_logs_versions_settings_and_states_and_no_picture(capture, tmp_path, capsys, monkeypatch):
    findings = problem_report.doctor.Findings(("device cpu",), (), ())
    monkeypatch.setattr(problem_report.doctor, "examine", lambda *_, **__: findings)
    (capture.logs / "scan.log").write_text("\n".join(LINES), encoding="utf-8")
    (capture.logs / "mine.log").write_text("somebody else's")
    settings = {"registration": {"template": "/home/zoeann/geheim.obj"}, "solve": {"steps": 31}}
    (capture.root / "job.json").write_text(json.dumps({"capture": ".", "settings": settings}))
    unforeseen.explain(ValueError("/home/zoeann/geheim"), "the trial")
    target = tmp_path / "report.zip"
    assert main(["report-problem", str(capture.root), "--to", str(target)]) == 0
    assert "Nothing was sent" in capsys.readouterr().out
    with zipfile.ZipFile(target) as archive:
        texts = {name: archive.read(name).decode() for name in archive.namelist()}
    assert set(texts) == {"doctor.txt", "unforeseen.txt", "report.json", "logs/scan.log"}
    whole = "\n".join((*texts, *texts.values()))
    assert not any(secret.lower() in whole.lower() for secret in SECRETS), whole
    told = json.loads(texts["report.json"])
    assert told["versions"]["WildCap"] and told["capture"]["settings"]["solve"]["steps"] == 31
    assert told["capture"]["settings"]["registration"]["template"] == REMOVED
    assert told["capture"]["stages"]["cameras"]["figures"] == {"count": 3}
    assert "WC-" in texts["unforeseen.txt"] and "device cpu" in texts["doctor.txt"]
    assert main(["report-problem", "--to", str(target)]) == 2 and "already exists" in capsys.readouterr().err
    assert main(["report-problem", str(tmp_path / "none"), "--to", str(tmp_path / "b.zip")]) == 2


def test_a_capture_that_cannot_be_read_is_reported_on_all_the_same(capture, tmp_path):
    capture.json.write_text("{")
    target = problem_report.write(tmp_path / "report", ROOT, None, capture)
    with zipfile.ZipFile(target) as archive:
        assert "capture.json" in json.loads(archive.read("report.json"))["capture"]["problem"]
        assert archive.read("doctor.txt").decode() == "No solver is set up."
