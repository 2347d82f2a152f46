# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a stranger's capture, its record and its links cannot make WildCap do; and whose failures are whose."""

import json

import pytest

from core.capture import ownership, processes
from core.capture.capture import Capture
from tests.fixtures.kept_capture import contents, make, make_frames


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "anna.wildcap")


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
    gone = {**processes.identify_process(), "pid": 2**22 + 1}
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


def test_a_failure_of_the_holders_own_is_not_told_as_one_of_the_lock(capture):
    for inside in (capture.locked, capture.workspace):
        with pytest.raises(FileNotFoundError, match="weights"), inside():
            raise FileNotFoundError("weights")
