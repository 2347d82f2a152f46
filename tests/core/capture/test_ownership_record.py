# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of what WildCap wrote into a capture: damaged, lost, long, copied, and a stranger's."""

import json
import shutil

import pytest

from core.capture import ownership, processes
from core.capture.capture import Capture
from core.capture.files import replacing
from tests.fixtures.kept_capture import NO_PROCESS, contents, make, make_frames


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
    assert left.exists()
    make_frames(capture, "00000.jpg", text="new")
    assert contents(capture.root / "kept") == {"frames/00000.jpg": b"frame"} and left.exists()


def test_a_line_that_was_cut_off_spoils_no_other(capture):
    for text in ("old", "new"):
        make_frames(capture, "00000.jpg", text=text)
        with open(capture.root / ownership.RECORD, "ab") as file:
            file.write(b'{"path": "frames/000')
    make_frames(capture, "00000.jpg", text="newer")
    assert contents(capture.root).keys() == {"capture.json", "frames/00000.jpg"}


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
    assert b"retouched" in contents(capture.root).values()


def test_a_copy_of_a_capture_knows_what_is_ours_by_content(capture, tmp_path):
    make_frames(capture, "00000.jpg")
    copied = Capture(tmp_path / "copy.wildcap")
    shutil.copytree(capture.root, copied.root, copy_function=shutil.copyfile)
    make_frames(copied, "00000.jpg", text="new")
    assert not (copied.root / "kept").exists()


@pytest.mark.parametrize(
    "name", ["../precious", "../../precious", "link/.precious", "precious", "/precious", "..\\precious", ".."]
)
def test_a_strangers_record_cannot_have_anything_outside_of_its_capture_removed(capture, tmp_path, name):
    outside = tmp_path / "outside"
    for folder in (tmp_path / "precious", outside / ".precious", capture.root / "precious"):
        folder.mkdir(parents=True)
        (folder / "work.psd").write_text("a day's work")
    (capture.root / "link").symlink_to(outside)
    before = contents(tmp_path)
    gone = {**processes.identify_process(), "pid": NO_PROCESS}
    for line in (
        {"temporary": name, "by": gone},
        {"temporary": name, "by": {}},
        {"temporary": ".x", "by": [1]},
        {"temporary": 3, "by": gone},
        [],
        1,
    ):
        with open(capture.root / ownership.RECORD, "a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
    with capture.locked():
        pass
    assert contents(tmp_path) == before


def test_a_link_in_a_folder_of_ours_stays_and_what_it_leads_to_too(capture, tmp_path):
    (tmp_path / "album").mkdir()
    (tmp_path / "album" / "a.jpg").write_text("mine")
    make_frames(capture, "00000.jpg")
    (capture.frames / "album").symlink_to(tmp_path / "album")
    (capture.frames / "nowhere").symlink_to(tmp_path / "nowhere")
    make_frames(capture, "00000.jpg", text="new")
    assert (capture.frames / "album" / "a.jpg").read_text() == "mine" and (capture.frames / "album").is_symlink()
    assert (capture.frames / "nowhere").is_symlink() and not list(capture.root.glob(".frames*"))


def test_a_failure_of_the_holders_own_is_not_reported_as_one_of_the_lock(capture):
    for inside in (capture.locked, capture.workspace):
        with pytest.raises(FileNotFoundError, match="weights"), inside():
            raise FileNotFoundError("weights")
