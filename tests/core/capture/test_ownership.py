# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What WildCap did not write it never deletes or overwrites; what it wrote and somebody changed is kept aside; what a
killed writer left goes."""

import os
from pathlib import Path

import pytest

from core.capture.capture import Capture
from core.capture.files import remove_file, replacing, replacing_folder, write_json
from core.capture.messages import Log, Problem
from core.worker import runner
from core.worker.job import write_job
from tests.fixtures.kept_capture import contents, kill_at_rename, make, make_frames, needs_fork


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "anna.wildcap")


# -- single files


def test_a_file_of_ours_is_replaced_and_one_that_was_changed_is_kept_aside(capture):
    path = capture.root / "texture.txt"
    for text in ("one", "two"):
        with replacing(path) as temporary:
            temporary.write_text(text)
    assert contents(capture.root).keys() == {"capture.json", "texture.txt"}
    path.write_text("by hand")
    for text in ("three", "four"):
        with replacing(path) as temporary:
            temporary.write_text(text)
    path.write_text("by hand again")
    with replacing(path) as temporary:
        temporary.write_text("five")
    assert path.read_text() == "five"
    kept = capture.root / "kept"
    assert (kept / "texture.txt").read_text() == "by hand" and (kept / "texture_2.txt").read_text() == "by hand again"


def test_removing_removes_ours_alone(capture):
    path = capture.root / "texture_detail.exr"
    with replacing(path) as temporary:
        temporary.write_text("ours")
    remove_file(path)
    assert not path.exists()
    path.write_text("theirs")
    remove_file(path)
    remove_file(path)
    assert not path.exists() and (capture.root / "kept" / path.name).read_text() == "theirs"


def test_every_file_of_a_capture_has_the_users_mode(capture):
    with replacing(capture.root / "a.bin") as temporary:
        os.close(os.open(temporary, os.O_CREAT | os.O_WRONLY, 0o600))
    with replacing_folder(capture.frames) as folder:
        os.close(os.open(folder / "b.bin", os.O_CREAT | os.O_WRONLY, 0o600))
    (capture.root.parent / "theirs").write_text("")
    files = capture.root / "a.bin", capture.frames / "b.bin", capture.json, capture.root.parent / "theirs"
    assert len({path.stat().st_mode for path in files}) == 1


# -- folders


def test_every_file_is_on_the_disk_before_it_gets_its_name(capture, monkeypatch):
    flushed, named = set(), set()
    fsync, rename = os.fsync, os.replace

    def flush(descriptor: int) -> None:
        flushed.add(os.fstat(descriptor).st_ino)
        fsync(descriptor)

    def place(path, into) -> None:
        files = Path(path).rglob("*") if Path(path).is_dir() else [Path(path)]
        named.update(file.stat().st_ino for file in files if file.is_file())
        assert named <= flushed
        rename(path, into)

    monkeypatch.setattr(os, "fsync", flush)
    monkeypatch.setattr(os, "replace", place)
    make_frames(capture, "00000.jpg", "00001.jpg")
    with replacing(capture.scan) as temporary:
        temporary.write_text("scan")
    assert len(named) == 3


def test_others_files_in_a_folder_of_ours_stay_and_changed_ones_are_kept_aside(capture):
    """Whether the new folder has a file of that name or not."""
    make_frames(capture, "00000.jpg", "00001.jpg")
    (capture.frames / "holiday.jpg").write_text("a picture")
    (capture.frames / "more").mkdir()
    (capture.frames / "more" / "notes.txt").write_text("notes")
    for name in ("00000.jpg", "00001.jpg"):
        (capture.frames / name).write_text(f"retouched {name}")
    make_frames(capture, "00000.jpg", text="new")
    assert contents(capture.frames) == {"00000.jpg": b"new", "holiday.jpg": b"a picture", "more/notes.txt": b"notes"}
    assert contents(capture.root / "kept") == {
        f"frames/{name}": f"retouched {name}".encode() for name in ("00000.jpg", "00001.jpg")
    }


@pytest.mark.skipif(os.name == "nt", reason="a link needs a privilege there")
def test_a_link_in_place_of_a_file_or_folder_of_ours_is_kept_aside_and_what_it_leads_to_stays(capture, tmp_path):
    """As somebody makes it who moves the frames to a larger disk, which may not be connected."""
    make_frames(capture, "00000.jpg", "00001.jpg")
    capture.frames.rename(tmp_path / "larger")
    (tmp_path / "larger" / "notes.txt").write_text("notes")
    before = contents(tmp_path / "larger")
    for number, leads_to in enumerate(("larger", "not connected")):
        link = capture.frames if number == 0 else capture.delit
        link.symlink_to(tmp_path / leads_to, target_is_directory=True)
        for text in ("new", "newer"):
            with replacing_folder(link) as folder:
                (folder / "00000.jpg").write_text(text)
        assert contents(link) == {"00000.jpg": b"newer"} and not link.is_symlink()
        assert (capture.root / "kept" / link.name).readlink() == tmp_path / leads_to
    capture.scan.symlink_to(tmp_path / "not connected" / "scan.ply")
    with replacing(capture.scan) as temporary:
        temporary.write_text("ours")
    assert (capture.root / "kept" / "scan.ply").readlink() == tmp_path / "not connected" / "scan.ply"
    left = capture.root / ".cameras.old"  # of a version that put links aside as folders
    left.symlink_to(tmp_path / "larger", target_is_directory=True)
    with replacing_folder(capture.cameras) as folder:
        (folder / "a.bin").write_text("cameras")
    assert not left.is_symlink() and (capture.root / "kept" / "cameras").readlink() == tmp_path / "larger"
    assert contents(tmp_path / "larger") == before


@needs_fork
@pytest.mark.parametrize("at", range(6))
def test_killed_at_any_rename_nothing_is_lost_and_the_next_run_clears_up(capture, at):
    make_frames(capture, "00000.jpg", "00001.jpg")
    (capture.frames / "00001.jpg").write_text("retouched")
    for name in ("holiday.jpg", "z.jpg"):
        (capture.frames / name).write_text(name)
    kill_at_rename(at, lambda: make_frames(capture, "00000.jpg", text="new"))
    with capture.locked():
        assert not [path for path in capture.root.rglob(".*")], "what the killed one left is gone"
    found = contents(capture.root)
    assert {found[f"frames/{name}"] for name in ("holiday.jpg", "z.jpg")} == {b"holiday.jpg", b"z.jpg"}
    assert found["frames/00000.jpg"] in (b"frame", b"new")
    assert b"retouched" in found.values()


@needs_fork
@pytest.mark.parametrize("at", [0, 1])
def test_killed_while_it_writes_the_captures_own_books_leaves_nothing_either(tmp_path, at):
    """capture.json when the folder becomes a capture (at 0: its first rename), and job.json."""
    capture = Capture(tmp_path / "anna.wildcap")
    kill_at_rename(at, lambda: (capture.claim(), write_json(capture.job, {})))
    assert len(list(capture.root.glob(".*.tmp.json"))) == 1
    with capture.locked():
        assert contents(capture.root).keys() == {"capture.json", "lock"}


def test_temporary_files_in_use_and_those_of_others_are_never_cleared_away(capture):
    (capture.root / ".mine.123.tmp.txt").write_text("it looks like one")
    with replacing(capture.root / "slow.txt") as temporary:
        temporary.write_text("half")
        with capture.locked():
            assert temporary.exists()
    assert (capture.root / "slow.txt").exists() and (capture.root / ".mine.123.tmp.txt").exists()


def test_the_workspace_of_a_stage_goes_with_it(capture):
    with capture.workspace() as work:
        assert work.is_relative_to(capture.root) and work.is_dir()
        with capture.locked():
            assert work.exists(), "in use"
    assert not work.exists()


# -- what runs log


@pytest.mark.parametrize("fails", [False, True])
def test_a_run_logs_what_it_kept_aside_also_where_it_fails(capture, monkeypatch, fails):
    monkeypatch.setattr(runner.report, "write", lambda *_: None)

    def run(capture, *_):
        make_frames(capture, "00000.jpg")
        if fails:
            raise Problem("No face was found.", "Film one.")

    monkeypatch.setattr(runner, "_room", lambda step: type("Room", (), {"run": staticmethod(run)}))
    make_frames(capture, "00000.jpg", text="old")
    (capture.frames / "00000.jpg").write_text("retouched")
    film = capture.root.parent / "film.mp4"
    film.write_bytes(b"film")
    messages: list = []
    runner.run_job(write_job(capture, source=film, last="frames"), messages.append)
    assert any(isinstance(each, Log) and "kept/frames/00000.jpg" in each.text for each in messages), messages
