# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of what WildCap wrote into a capture: damaged, lost, long and copied."""

import json
import shutil

import pytest

from core.capture import ownership
from core.capture.capture import Capture
from core.capture.files import replacing
from core.capture.hashes import read_hash
from tests.fixtures.kept_capture import contents, make, make_frames


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "anna.wildcap")


def test_what_lies_in_a_capture_whose_record_was_lost_may_be_anybodys(capture):
    make_frames(capture, "00000.jpg")
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
