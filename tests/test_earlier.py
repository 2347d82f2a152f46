# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures are taken through an earlier version's own code, and what both made is compared person by person."""

import json
from pathlib import Path

import pytest

from benchmarks import earlier, state, state_captures
from benchmarks.figures import Figures
from benchmarks.results import state_0_1_0
from core.contract.capture import Capture

SOLVE = """
import pathlib
def solve(capture, truth, until, quality):
    if truth.name == "ben":
        raise SystemExit("no face")
    (capture.root / "texture.exr").write_text(" ".join([truth.name, until, quality,
                                                        str(pathlib.Path.cwd() == pathlib.Path(__file__).parents[1])]))
"""


@pytest.fixture
def folders(tmp_path):
    """A checkout whose solve says what it was asked for, and two captures with a truth."""
    checkout = tmp_path / "checkout"
    for path, text in (
        ("core/__init__.py", ""),
        ("core/capture.py", "class Capture:\n    def __init__(self, root):\n        self.root = root\n"),
        ("benchmarks/__init__.py", ""),
        ("benchmarks/people.py", SOLVE),
    ):
        (checkout / path).parent.mkdir(parents=True, exist_ok=True)
        (checkout / path).write_text(text)
    for name in ("anna", "ben"):
        capture = Capture(tmp_path / "people" / f"{name}.wildcap")
        capture.claim()
        for path in ("frames/frames.json", "cameras/cameras.bin", "head.obj", "texture.exr", "delit/0.png"):
            (capture.root / path).parent.mkdir(exist_ok=True)
            (capture.root / path).write_text(f"{name} {path}")
        (tmp_path / "people" / name / "albedo").mkdir(parents=True)
    return checkout, tmp_path / "people", tmp_path / "out"


def run(monkeypatch, *folders: Path) -> int:
    monkeypatch.setattr("sys.argv", ["earlier", *map(str, folders)])
    return earlier.main()


def test_an_earlier_version_gets_frames_cameras_and_head_and_nothing_else(folders, monkeypatch, capfd):
    assert run(monkeypatch, *folders) == 1
    assert "anna: solved" in capfd.readouterr().out
    made = folders[2] / "anna.wildcap"
    assert (made / "texture.exr").read_text() == "anna solve standard True"
    assert (made / "head.obj").read_text() == "anna head.obj" and not (made / "delit").exists()
    assert json.loads((made / "capture.json").read_text()) == {"format": 1, "source": "", "stages": {}}


def test_a_head_is_enough_for_it_and_without_one_there_is_nothing_to_solve(folders, monkeypatch, capfd):
    (folders[1] / "anna.wildcap" / "texture.exr").unlink()
    (folders[1] / "ben.wildcap" / "head.obj").unlink()
    assert run(monkeypatch, *folders) == 0
    assert capfd.readouterr().out == "anna: solved\n"
    (folders[1] / "anna.wildcap" / "head.obj").unlink()
    with pytest.raises(SystemExit):
        run(monkeypatch, *folders)
    assert "no capture with a head and a truth" in capfd.readouterr().err


def test_one_that_fails_is_named_and_the_others_go_on(folders, monkeypatch, capfd):
    (folders[1] / "ben.wildcap").rename(folders[1] / "aaron.wildcap")  # the first in order
    (folders[1] / "ben").rename(folders[1] / "aaron")
    people = folders[0] / "benchmarks" / "people.py"
    people.write_text(people.read_text().replace('"ben"', '"aaron"'))
    assert run(monkeypatch, *folders) == 1
    told = capfd.readouterr()
    assert "aaron: not solved" in told.out and "anna: solved" in told.out and "no face" in told.err


def test_a_checkout_of_another_version_is_refused(folders, monkeypatch, capsys):
    (folders[0] / "core" / "capture.py").unlink()
    with pytest.raises(SystemExit):
        run(monkeypatch, *folders)
    assert "holds no code of 0.1.0" in capsys.readouterr().err


def test_its_captures_were_made_by_one_code_whatever_their_inputs(folders):
    for name in ("anna", "ben"):
        path = folders[1] / f"{name}.wildcap" / "capture.json"
        record = json.loads(path.read_text())
        record["stages"]["solve"] = {"key": f"of {name}", "seconds": 1.0}
        path.write_text(json.dumps(record))
    captures = state_captures.find(folders[1], folders[1], folders[1] / "state")
    assert len(captures) == 2 and state.code_of(captures)["solve"] == "0.1.0"


def test_people_are_compared_on_the_same_captures():
    before = Figures.of(
        {
            "people": {
                "solved": {
                    "ann": {"psnr": 25.0, "captures": 3},
                    "bob": {"psnr": 20.0, "captures": 1},
                    "cat": {"psnr": 22.0, "captures": 2},
                }
            }
        }
    )
    bob = {"solved": {"psnr": 24.0, "psnr_shared": 23.0, "psnr_alone": 26.0}}
    now = Figures.of(
        {
            "people": {
                "solved": {
                    "ann": {"psnr": 27.0, "captures": 3},
                    "bob": {"psnr": 30.0, "captures": 3},
                    "cat": {"psnr": 31.0, "captures": 3},
                }
            },
            "captures": {"bob": bob, "bob_below": {"solved": {"psnr": 33.0, "psnr_alone": 33.0}}},
        }
    )
    scores = state_0_1_0.paired(before, now, "solved")
    assert {method: list(people) for method, people in scores.items()} == {
        "solved, 0.1.0": ["ann", "bob"],
        "solved": ["ann", "bob"],
    }
    assert scores["solved"]["ann"]["psnr"] == 27.0 and scores["solved"]["bob"]["psnr"] == 24.0
    assert scores["solved"]["bob"]["psnr_shared"] == 26.0, "of one capture, the light that is shared is its own"


def test_the_page_names_the_captures_that_were_left_out():
    today = Figures.of({"captures": {"ann": {}, "ann_below": {}, "bob": {}}})
    assert state_0_1_0.left_out(Figures.of({"captures": {"ann": {}}}), today) == (
        "Not taken through it were ann_below, bob."
    )
    assert state_0_1_0.left_out(today, today) == "None was left out."
