# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The capture folder: which folder becomes one, what it records, and that no file is ever half written."""

import errno
import os

import pytest

from core.capture import files, mask_history, ownership
from core.capture.capture import FORMAT, Capture
from core.capture.files import replacing, replacing_folder, write_json
from core.capture.messages import Failed
from core.worker.job import write_job
from core.worker.runner import run_job
from tests.fixtures.kept_capture import contents, make_frames
from tests.fixtures.recorded import make
from tests.fixtures.refused import refuses


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "Zoë & Åse.wildcap")


# -- which folder


def test_a_folder_that_holds_something_else_is_never_taken_over(tmp_path):
    """`core run anna/frames anna`: the folder's names look like a capture's."""
    album = tmp_path / "anna"
    (album / "frames").mkdir(parents=True)
    (album / "frames" / "holiday.jpg").write_bytes(b"a picture")
    before = contents(tmp_path)
    capture = Capture(album)
    for attempt in (
        capture.claim,
        lambda: capture.set_source(tmp_path / "film.mp4"),
        lambda: write_job(capture),
        capture.locked().__enter__,
    ):
        refuses("frames", attempt)
    assert contents(tmp_path) == before


def test_a_capture_without_its_record_starts_anew_and_loses_nothing(capture):
    make_frames(capture, "00000.jpg")
    capture.shadow_mask.write_text("painted")
    before = {name: content for name, content in contents(capture.root).items() if name != "capture.json"}
    capture.json.unlink()
    capture.claim()
    assert contents(capture.root).items() >= before.items() and capture.read()["stages"] == {}
    for path in (capture.json, capture.root / ownership.RECORD):
        path.unlink()
    refuses("no capture|not a capture", capture.claim)


def test_a_source_inside_the_capture_is_refused(capture):
    (capture.root / "my film.mp4").write_bytes(b"film")
    for source in (capture.root / "my film.mp4", capture.frames, capture.root):
        for attempt in (capture.set_source, lambda source: write_job(capture, source=source)):
            refuses("lies in the capture", attempt, source)


# -- its record


@pytest.mark.parametrize(("number", "words"), [(FORMAT + 1, "newer version"), (FORMAT - 1, "pre-release")])
def test_a_capture_of_another_format_is_refused_and_left_alone(capture, number, words):
    assert FORMAT == 2
    write_json(capture.json, {**capture.read(), "format": number})
    before = capture.json.read_bytes()
    for attempt in (capture.read, lambda: capture.set_source("x"), lambda: capture.forget(["frames"])):
        refuses(words, attempt)
    assert capture.json.read_bytes() == before


@pytest.mark.parametrize("name", ["3:4 view.mov", "A:B.mov", "a\\b.mov", "  film.mov"])
def test_a_source_may_have_any_name_that_its_system_takes(tmp_path, name):
    film = tmp_path / name
    film.write_bytes(b"film")
    capture = Capture(tmp_path / "a.wildcap")
    capture.set_source(film)
    assert capture.read()["source_stamp"][0][0] == name and capture.source == film


def test_a_source_that_may_not_be_read_is_a_problem(tmp_path, monkeypatch):
    film, capture = tmp_path / "film.mp4", Capture(tmp_path / "a.wildcap")
    film.write_bytes(b"film")

    def refuse(*_):
        raise PermissionError(errno.EPERM, "Operation not permitted", str(film))

    job = write_job(capture, source=film, last="frames")
    monkeypatch.setattr(Capture, "made_from", refuse)
    ended = run_job(job, lambda message: None)
    assert isinstance(ended, Failed) and ended.problem == f"{film} cannot be read."
    assert "Files and Folders" in ended.remedy
    monkeypatch.setattr(os, "listdir", refuse)
    refuses("cannot be read .*Operation not permitted", write_job, capture, source=tmp_path)


# -- its files


def test_replacing_keeps_the_old_file_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")
    with pytest.raises(KeyError), replacing(path) as temporary:
        temporary.write_text("half")
        raise KeyError
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new" and list(tmp_path.iterdir()) == [path]


def test_replacing_a_folder_is_all_or_nothing(tmp_path):
    Capture(tmp_path).claim()
    path = tmp_path / "frames"
    with replacing_folder(path) as folder:
        (folder / "1").write_text("old")
    with pytest.raises(KeyError), replacing_folder(path) as folder:
        (folder / "1").write_text("half")
        raise KeyError
    assert (path / "1").read_text() == "old"
    with replacing_folder(path) as folder:
        (folder / "2").write_text("new")
    assert [file.name for file in path.iterdir()] == ["2"]
    assert {file.name for file in tmp_path.iterdir()} == {"frames", "capture.json", "written.jsonl"}


def test_on_windows_a_file_that_is_open_elsewhere_is_tried_again_and_then_named(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "ON_WINDOWS", True)
    replace, tries = os.replace, []

    def scanned(path, into):
        tries.append(into)
        if len(tries) < most:
            raise PermissionError(errno.EACCES, "in use")
        replace(path, into)

    monkeypatch.setattr(files.os, "replace", scanned)
    most = 3
    write_json(tmp_path / "a.json", 1)
    assert len(tries) == 3 and (tmp_path / "a.json").read_text() == "1"
    most = 1000
    monkeypatch.setattr(files, "OPEN_ELSEWHERE_S", 0.1)
    refuses("another program", write_json, tmp_path / "a.json", 2)
    assert (tmp_path / "a.json").read_text() == "1"


def test_the_last_masks_are_kept_in_order_wherever_the_clock_stands(tmp_path, monkeypatch):
    """A copy is not the oldest because the clock was set back."""
    capture, clock = Capture(tmp_path / "a.wildcap"), iter(range(40, 0, -1))
    capture.claim()
    monkeypatch.setattr(mask_history.time, "time_ns", lambda: next(clock) * 3600 * 10**9)
    masks = [b"mask %d" % i for i in range(14)]
    for content in masks:
        copy = mask_history.keep(capture, capture.shadow_mask, content)
        assert copy.read_bytes() == content
    kept = [path.read_bytes() for path in sorted(capture.mask_history.iterdir())]
    assert kept == masks[-mask_history.KEPT_MASKS :] and len(kept) == 10
    (capture.mask_history / "shadow_mask_99999999_999999_999.png").write_bytes(b"another name")
    assert mask_history.keep(capture, capture.shadow_mask, b"one more").exists()
