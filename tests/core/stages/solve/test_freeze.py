# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a solve begins with is kept as it was, and what has changed is told."""

import json

import pytest

from core.capture.capture import Capture
from research.benchmarks import freeze
from tests.fixtures.recorded import make_entry
from tests.fixtures.refused import refused


@pytest.fixture
def captures(tmp_path):
    paths = ["head.obj", "texture_filmed.png", "delit/00000.png", "delit/shadow/00000.png", "checkpoints/solve.bin"]
    for name in ("anna", "ben", "untextured"):
        capture = Capture(tmp_path / "in" / f"{name}.wildcap")
        capture.claim()
        record = json.loads(capture.json.read_text())
        record["stages"]["texture"] = make_entry(code="abc")
        capture.json.write_text(json.dumps(record))
        for path in (*paths, *(["texture.exr"] if name != "untextured" else [])):
            (capture.root / path).parent.mkdir(exist_ok=True, parents=True)
            (capture.root / path).write_text(f"{name} {path}")
    return tmp_path


def test_what_is_kept_stays_and_is_what_was_there_and_a_run_goes_on_where_one_was_killed(captures):
    out = captures / "out"
    assert freeze.freeze(captures / "in", out, ("anna",)) == [] == freeze.differences(out)
    (out / ".ben.wildcap.1.tmp").mkdir()
    assert freeze.freeze(captures / "in", out) == [] == freeze.differences(out)
    assert {path.name for path in out.iterdir()} >= {"anna.wildcap", "ben.wildcap", "frozen.json"}
    assert set(freeze.read_record(out)) == {"anna", "ben"}
    assert (out / "anna.wildcap" / "delit" / "shadow" / "00000.png").read_text() == "anna delit/shadow/00000.png"
    assert not (out / "anna.wildcap" / "checkpoints").exists()
    recorded = {"version": "0.2.0", "code": "abc", "finished": "2026-11-22T00:00:00", "seed": 0, "settings": {}}
    assert freeze.read_record(out)["anna"]["stages"] == {"texture": recorded}
    (captures / "in" / "ben.wildcap" / "texture.exr").write_text("another delighter's")
    assert freeze.freeze(captures / "in", out) == ["ben"]
    assert (out / "ben.wildcap" / "texture.exr").read_text() == "ben texture.exr" and freeze.differences(out) == []


def test_a_change_is_named(captures, monkeypatch, capsys):
    out = captures / "out"
    freeze.freeze(captures / "in", out)
    (out / "anna.wildcap" / "head.obj").unlink()
    (out / "ben.wildcap" / "texture.exr").write_text("solved in place")
    (out / "ben.wildcap" / "delit" / "00001.png").write_text("one more")
    capsys.readouterr()
    monkeypatch.setattr("sys.argv", ["freeze", "--check", str(out)])
    assert freeze.main() == 1
    assert capsys.readouterr().out.splitlines() == [
        "anna: head.obj is missing.",
        "ben: delit/00001.png was added.",
        "ben: texture.exr has changed.",
    ]


def test_nothing_is_kept_in_the_repository_or_of_nothing(captures):
    refused(lambda: freeze.freeze(captures / "in", freeze.ROOT / "frozen"), "in the repository")
    refused(lambda: freeze.freeze(captures / "out", captures / "frozen"), "no capture with a texture")
