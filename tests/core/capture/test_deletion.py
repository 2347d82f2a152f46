# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Deleting a face: the list says all that goes, exactly that goes, and nothing that WildCap did not write."""

import os

import pytest

from core.__main__ import main
from core.capture import deletion, ownership
from core.capture.capture import Capture
from core.capture.files import replacing
from tests.fixtures import delivered, kept_capture
from tests.fixtures.kept_capture import make_frames


@pytest.fixture
def capture(tmp_path) -> Capture:
    """Frames, a render, a log and a delivery of ours, and a folder with somebody's film elsewhere."""
    capture = kept_capture.make(tmp_path / "Zoë et moi.wildcap")
    make_frames(capture, "00000.jpg", "00001.jpg")
    for path in (capture.renders / "sun.png", capture.maps / "normal.png", capture.head):
        with replacing(path) as temporary:
            temporary.write_bytes(b"ours")
    capture.logs.mkdir()
    (capture.logs / "solve.log").write_text("log")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "film.mp4").write_bytes(b"mine")
    return capture


def strangers(capture: Capture) -> dict[str, bytes]:
    """Puts files of somebody else's into a capture; what must be there afterwards."""
    (capture.frames / "00001.jpg").write_text("retouched")
    (capture.renders / "graded.psd").write_text("mine")
    (capture.root / "notes").mkdir()
    (capture.root / "notes" / "solve.log").write_text("mine, too")
    os.symlink(capture.root.parent / "elsewhere", capture.root / "shots")
    return {"frames/00001.jpg": b"retouched", "renders/graded.psd": b"mine", "notes/solve.log": b"mine, too"}


def test_all_of_a_face_goes_and_its_folder_and_nothing_beside_it(tmp_path):
    capture = delivered.make(tmp_path / "Zoë et moi.wildcap")
    ownership.claim_all(capture.root)
    delivered.deliver(capture, **delivered.OBJ)
    (tmp_path / "film.mp4").write_bytes(b"mine")
    plan = deletion.plan(capture)
    assert {group.label for group in plan.groups} >= {"Exports", "Maps", "Head"} and plan.staying == ()
    assert plan.size == sum(path.stat().st_size for path in capture.root.rglob("*") if path.is_file())
    assert deletion.delete(capture).staying == ()
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]


def test_what_others_put_there_or_changed_is_named_and_stays(capture):
    kept = strangers(capture)
    plan = deletion.plan(capture)
    assert set(plan.staying) == {*kept, "shots"}
    text = " ".join(deletion.lines(plan))
    assert "4 files" in text and all(name in text for name in plan.staying)
    deletion.delete(capture)
    assert kept_capture.contents(capture.root) == kept
    assert (capture.root.parent / "elsewhere" / "film.mp4").read_bytes() == b"mine"
    assert (capture.root / "shots").is_symlink() and not capture.json.exists()


def test_an_empty_folder_of_somebody_s_stays(capture):
    (capture.root / "ideas").mkdir()
    deletion.delete(capture)
    assert [path.name for path in capture.root.iterdir()] == ["ideas"]


def test_the_terminal_lists_first_and_deletes_when_told_to(capture, capsys):
    assert main(["delete", str(capture.root)]) == 0
    assert "Renders" in capsys.readouterr().out and capture.head.exists(), "only listed"
    assert main(["delete", str(capture.root), "--yes"]) == 0 and not capture.root.exists()
    assert main(["delete", str(capture.root)]) == 2 and "no capture" in capsys.readouterr().err
