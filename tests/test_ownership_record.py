# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of what WildCap wrote into a capture: of 0.1.0's captures, damaged, lost, long and copied."""

import json
import shutil

import pytest

from core.contract import ownership
from core.contract.capture import Capture
from core.contract.files import replacing
from core.contract.hashes import read_hash

from .kept_capture import contents, make, make_frames


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "anna.wildcap")


def test_a_capture_of_0_1_0_gets_a_record_of_what_it_wrote_and_of_nothing_else(tmp_path):
    root = tmp_path / "old.wildcap"
    (root / "frames").mkdir(parents=True)
    for name, text in (
        ("frames/00000.jpg", "frame"),
        ("frames/frames.json", "{}"),
        ("frames/2026 holiday.jpg", "a picture"),
        ("head.obj", "head"),
        ("notes.txt", "mine"),
        (".scan.99999999.tmp.ply", "half"),
        ("frames/.00001.99999999.tmp.jpg", "half"),
        ("frames/.mine.1.tmp.jpg", "mine"),
        (".notes.old", "mine"),
    ):
        (root / name).write_text(text)
    (root / ".maps.99999999.tmp").mkdir()
    (root / "capture.json").write_text(json.dumps({"format": 1, "source": "", "stages": {"frames": {}}}))
    capture = Capture(root)
    with capture.locked():
        pass
    assert not any(
        (root / name).exists()
        for name in (".scan.99999999.tmp.ply", "frames/.00001.99999999.tmp.jpg", ".maps.99999999.tmp")
    )
    assert (root / "frames" / ".mine.1.tmp.jpg").read_text() == (root / ".notes.old").read_text() == "mine", (
        "such names are not 0.1.0's alone"
    )
    make_frames(capture, "00000.jpg", text="new")
    with replacing(capture.head) as temporary:
        temporary.write_text("new")
    assert contents(root).keys() == {
        "capture.json",
        "frames/00000.jpg",
        "frames/2026 holiday.jpg",
        "head.obj",
        "notes.txt",
        ".notes.old",
        "frames/.mine.1.tmp.jpg",
    }


def test_the_first_thing_written_into_a_capture_of_0_1_0_does_not_hide_what_it_wrote(tmp_path):
    root = tmp_path / "old.wildcap"
    root.mkdir()
    (root / "capture.json").write_text(json.dumps({"format": 1, "source": "", "stages": {"solve": {}}}))
    capture = Capture(root)
    for path in (capture.shadow_mask, capture.head):
        path.write_text("by 0.1.0")
    for path in (capture.shadow_mask, capture.head):  # a mask painted in Blender, before any worker
        with replacing(path) as temporary:
            temporary.write_text("new")
    assert not (root / "kept").exists()


def test_a_capture_of_today_whose_record_was_lost_is_not_taken_for_one_of_0_1_0(capture):
    make_frames(capture, "00000.jpg")
    capture.json.write_text(json.dumps({"format": 2, "source": "", "stages": {"frames": {}}}))
    (capture.root / ownership.RECORD).unlink()
    left = capture.frames / ".00001.99999999.tmp.jpg"
    left.write_text("anybody's")
    with capture.locked():
        pass
    assert left.exists() and not ownership.is_ours(capture.root, capture.frames / "00000.jpg")
    make_frames(capture, "00000.jpg", text="new")
    assert (capture.root / "kept" / "frames" / "00000.jpg").exists() and left.exists()


def test_a_record_with_a_line_cut_off_is_read_and_a_lost_one_loses_no_file(capture):
    make_frames(capture, "00000.jpg")
    record = capture.root / ownership.RECORD
    with open(record, "ab") as file:
        file.write(b'{"path": "frames/000')
    make_frames(capture, "00000.jpg", text="new")
    make_frames(capture, "00000.jpg", text="newer")
    assert contents(capture.root).keys() == {"capture.json", "frames/00000.jpg"}, (
        "the line after it is a line of its own"
    )
    with open(record, "ab") as file:
        file.write(b'{"path": "frames/000')
    (capture.root / "a.txt").write_text("ours")
    ownership.note_written(capture.root, {"a.txt": read_hash(capture.root / "a.txt")})
    assert ownership.is_ours(capture.root, capture.root / "a.txt")
    (capture.root / "a.txt").unlink()
    record.unlink()
    make_frames(capture, "00000.jpg", text="newest")
    assert contents(capture.root / "kept") == {"frames/00000.jpg": b"newer"}


def test_a_long_record_is_shortened_to_what_is_there(capture, monkeypatch):
    monkeypatch.setattr(ownership, "LONG_BYTES", 2000)
    make_frames(capture, "00000.jpg", "00001.jpg")
    for number in range(40):
        with replacing(capture.shadow_mask) as temporary:
            temporary.write_text(str(number))
    (capture.frames / "00001.jpg").write_text("retouched")
    with capture.locked():
        pass
    lines = [json.loads(line) for line in (capture.root / ownership.RECORD).read_text().splitlines()]
    assert [line["path"] for line in lines] == ["frames/00000.jpg", "shadow_mask.png"], "what was changed is not ours"
    make_frames(capture, "00000.jpg", text="new")
    kept = contents(capture.root / "kept")
    assert kept == {"frames/00001.jpg": b"retouched"} or (capture.frames / "00001.jpg").read_text() == "retouched"


def test_a_copy_of_a_capture_knows_what_is_ours_by_content(capture, tmp_path):
    make_frames(capture, "00000.jpg")
    copied = Capture(tmp_path / "copy.wildcap")
    shutil.copytree(capture.root, copied.root, copy_function=shutil.copyfile)
    make_frames(copied, "00000.jpg", text="new")
    assert not (copied.root / "kept").exists()
