# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes a stage out of date and what does not: inputs, settings, the source, older code, another place on another
disk."""

import os
import shutil
from pathlib import Path

import pytest

from core.capture import freshness, hashes
from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.hashes import hash_source, same_source
from core.capture.messages import Log
from core.capture.portable_paths import read_portable, write_portable
from core.settings.settings import Settings, from_json
from core.worker import runner
from core.worker.job import read_job, write_job
from tests.fixtures.recorded import CAMERAS, FRAMES, make, record, states


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "project" / "Zoë & Åse.wildcap")


def test_what_a_system_leaves_in_a_folder_that_was_looked_into_changes_nothing(capture):
    for name in (".DS_Store", "._00000.jpg", "Thumbs.db", "desktop.ini"):
        (capture.frames / name).write_text("by the system")
    assert states(capture) == ["done", "done"]
    (capture.frames / "mine.jpg").write_text("by hand")
    assert states(capture) == ["done", "stale"]


def test_a_stage_whose_outputs_are_gone_is_to_do_whatever_else_its_entry_holds(capture):
    record = capture.read()
    record["stages"]["frames"]["unknown"] = []
    write_json(capture.json, record)
    assert states(capture) == ["done", "done"]
    shutil.rmtree(capture.frames)
    assert states(capture) == ["to do", "stale"]


def test_what_a_setting_names_elsewhere_counts_by_what_it_holds(capture, tmp_path):
    model = tmp_path / "model.json"
    model.write_text("cameras", encoding="utf-8")
    settings = from_json({"cameras": {"import_from": str(model)}})
    assert states(capture, settings) == ["done", "stale"], "it was solved without that file"
    record(capture, CAMERAS, settings)
    assert states(capture, settings) == ["done", "done"]
    assert states(capture) == ["done", "stale"], "the setting was emptied"
    moved = tmp_path / "moved.json"
    shutil.move(model, moved)
    assert states(capture, settings) == ["done", "done"], "what is gone cannot tell that it changed"
    settings = from_json({"cameras": {"import_from": str(moved)}})
    assert states(capture, settings) == ["done", "done"]
    moved.write_text("other cameras", encoding="utf-8")
    assert capture.verdict(CAMERAS, settings).changed == ("cameras.import_from",)


# -- the source


def test_a_video_is_what_it_holds_wherever_and_whenever_it_was_put(capture, tmp_path):
    moved = tmp_path / "archive" / "renamed.mp4"
    moved.parent.mkdir()
    shutil.move(tmp_path / "project" / "film.mp4", moved)
    assert states(capture) == ["done", "done"], "gone: the frames are what is left of it"
    os.utime(moved, (1, 1))
    assert capture.made_from(moved)
    capture.set_source(moved)
    assert states(capture) == ["done", "done"]
    moved.write_bytes(b"FILM")  # as long as the other
    assert states(capture)[0] == "stale" and not capture.made_from(moved)
    assert capture.verdict(FRAMES, Settings()).changed == (freshness.SOURCE,)


def test_a_capture_that_was_copied_to_another_disk_with_its_video_is_the_same(capture, tmp_path):
    copied = tmp_path / "other disk" / "project"
    shutil.copytree(tmp_path / "project", copied, copy_function=shutil.copyfile)  # new times everywhere
    shutil.rmtree(tmp_path / "project")
    there = Capture(copied / capture.root.name)
    assert states(there) == ["done", "done"]
    assert there.source == copied / "film.mp4" and there.source.is_file()
    assert str(tmp_path) not in there.json.read_text(encoding="utf-8")


def test_photographs_are_known_by_name_and_content_and_hidden_files_do_not_count(tmp_path):
    folder = tmp_path / "photographs"
    folder.mkdir()
    for name in ("a.jpg", "b.jpg"):
        (folder / name).write_bytes(name.encode())
    before = hash_source(folder)
    for name in (".DS_Store", "Thumbs.db", "a.jpg.xmp", "notes.txt"):
        (folder / name).write_bytes(b"x")
    assert same_source(before, hash_source(folder))
    os.rename(folder / "a.jpg", folder / "c.jpg")  # the order is another one now
    assert not same_source(before, hash_source(folder))


def test_a_long_video_is_known_by_its_size_and_blocks_from_its_first_byte_to_its_last(tmp_path, monkeypatch):
    monkeypatch.setattr(hashes, "WHOLE_BYTES", 1000)
    monkeypatch.setattr(hashes, "BLOCK_BYTES", 10)
    content = bytearray(os.urandom(5000))
    film = tmp_path / "film.mp4"

    def stamp(changed: int | None = None, length: int = 5000) -> list:
        now = bytearray(content[:length])
        if changed is not None:
            now[changed] ^= 1
        film.write_bytes(now)
        hashes._hashes.clear()
        return hash_source(film)

    before = stamp()
    assert same_source(before, stamp())
    for place in (0, 9, -1, -10, *(block * 4990 // 63 for block in (1, 31, 62))):
        assert not same_source(before, stamp(place)), place
    assert not same_source(before, stamp(length=4999))
    assert same_source(before, stamp(40)), "between two blocks: the price of not reading a long film"
    whole = stamp(length=1000)
    for place in (0, 15, 40, 999):
        assert not same_source(whole, stamp(place, 1000)), "up to WHOLE_BYTES every byte counts"


# -- paths


def test_paths_in_a_capture_are_relative_where_both_may_be_moved_together(tmp_path):
    root = tmp_path / "project" / "anna.wildcap"
    for inside in (root / "template" / "a.obj", root.parent / "film.mp4", tmp_path / "videos" / "film.mp4"):
        text = write_portable(inside, root)
        assert not Path(text).is_absolute() and "\\" not in text
        assert read_portable(text, root) == inside
        assert read_portable(text, Path("/elsewhere/project/anna.wildcap")) != inside
    assert write_portable("/film.mp4", root) == str(Path("/film.mp4").absolute())
    film = Path.home() / "Videos" / "film.mp4"
    assert write_portable(film, Path.home() / "Documents" / "anna.wildcap") == str(film)
    assert read_portable("/film.mp4", root) == Path("/film.mp4").absolute()


def test_a_job_names_no_folder_that_a_copy_would_not_have(capture, tmp_path):
    (tmp_path / "model.json").write_text("{}", encoding="utf-8")
    path = write_job(
        capture,
        source=tmp_path / "project" / "film.mp4",
        settings={"cameras": {"import_from": str(tmp_path / "model.json")}},
    )
    assert str(tmp_path) not in path.read_text(encoding="utf-8")
    job = read_job(path)
    assert job.capture.root == capture.root and job.source == str(tmp_path / "project" / "film.mp4")
    assert job.settings.cameras.import_from == str(tmp_path / "model.json")


def test_a_run_keeps_what_older_code_made_says_so_and_forced_makes_it_again(capture, monkeypatch):
    ran, said = [], []
    monkeypatch.setattr(
        runner, "_room", lambda step: type("Room", (), {"run": staticmethod(lambda *_: ran.append(step.name))})
    )
    monkeypatch.setattr(freshness, "code_key", lambda module: "another version's")
    monkeypatch.setattr(runner.report, "write", lambda *_: None)
    runner.run_job(write_job(capture, last="cameras"), said.append)
    assert ran == [] and states(capture) == ["older", "older"]
    assert "older code and kept: Frames, Cameras" in [line.text for line in said if isinstance(line, Log)][-1]
    runner.run_job(write_job(capture, first="cameras", last="cameras"), said.append)
    assert ran == ["cameras"] and states(capture) == ["older", "done"]
