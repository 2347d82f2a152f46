# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches over rooms of a few lines: what is done is done once, what fails is told in one line, and the rest goes
on."""

import hashlib
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.batch import gate, lines, local
from core.batch.known_hashes import known_hashes
from core.batch.record import read_batch
from core.batch.state import DONE, STOPPED, TO_DO, WAITING, WORKING, derive_state
from core.capture import hashes, lease
from core.capture.messages import Problem, Progress
from tests.fixtures import tiny_batch
from tests.fixtures.tiny_batch import core, finished, make, states


@pytest.fixture(scope="module")
def code(tmp_path_factory):
    return tiny_batch.build(tmp_path_factory.mktemp("tiny"))


def test_a_batch_is_done_once(code, tmp_path):
    batch = make(code, tmp_path)
    assert states(batch) == dict.fromkeys("abc", TO_DO)
    ran = core(code, "batch", "run", batch.root, "--at-once", 2)
    assert ran.returncode == 0 and ran.stdout.splitlines()[-1] == "3 faces: 3 done", ran.stdout + ran.stderr
    assert states(batch) == dict.fromkeys("abc", DONE)
    once = finished(batch)
    assert core(code, "batch", "run", batch.root).returncode == 0 and finished(batch) == once
    assert not lease.holder(batch.root / "lock") and core(code, "batch", "commands", batch.root).stdout == ""
    told = core(code, "batch", "status", batch.root).stdout.splitlines()
    assert [line.split() for line in told[:3]] == [[name, "done"] for name in "abc"] and told[3] == "3 done"


def test_one_that_stops_keeps_nobody(code, tmp_path):
    batch = make(code, tmp_path, "abcd", {"b": {"scan": "finding"}, "c": {"delight": "full"}})
    (tmp_path / "films" / "d.mp4").unlink()
    ran = core(code, "batch", "run", batch.root)
    said = {line.partition(":")[0]: line for line in ran.stdout.splitlines()}
    assert ran.returncode == 2 and ran.stderr == "" and ran.stdout.splitlines()[-1] == "4 faces: 1 done, 3 stopped"
    assert "head stopped: The face is not there. Film it." in said["b"] and "The disk is full" in said["c"]
    assert "There is no video or folder at" in said["d"]
    assert states(batch) == {"a": DONE, "b": STOPPED, "c": TO_DO, "d": TO_DO}, (
        "a disk with room again, a film that is back: nobody has to say so"
    )
    for face in batch.faces:
        tiny_batch.set_mood(face.capture, {})
    (tmp_path / "films" / "d.mp4").write_bytes(b"d")
    once = finished(batch)
    assert core(code, "batch", "run", batch.root).returncode == 2
    assert states(batch) == {"a": DONE, "b": STOPPED, "c": DONE, "d": DONE}, (
        "what has stopped at a face's own fault is not tried again by itself"
    )
    assert core(code, "batch", "retry", batch.root, "b").returncode == 0
    assert states(batch) == dict.fromkeys("abcd", DONE)
    assert finished(batch)["a"] == once["a"] and finished(batch)["b"]["frames"] == once["b"]["frames"]


def test_a_worker_that_dies_is_started_once_more(code, tmp_path):
    """It may have been killed for the memory that the one beside it took; one that dies again stops its face."""
    batch = make(code, tmp_path, "ab", {"a": {"scan": "die once"}, "b": {"scan": "die"}})
    ran = core(code, "batch", "run", batch.root)
    said = {line.partition(":")[0]: line for line in ran.stdout.splitlines()}
    assert (
        states(batch) == {"a": DONE, "b": TO_DO}
        and "head stopped: The worker ended unexpectedly during the stage scan" in said["b"]
    )
    assert (
        "scan" in batch.faces[0].capture.read()["stages"]
        and ran.stdout.splitlines()[-1] == "2 faces: 1 done, 1 stopped"
    )


def test_a_capture_that_is_worked_on_elsewhere_is_told_and_the_rest_goes_on(code, tmp_path):
    batch = make(code, tmp_path, "ab")
    with batch.faces[0].capture.locked():
        assert derive_state(batch, batch.faces[0]).state == WORKING
        ran = core(code, "batch", "run", batch.root)
        assert (
            f"a: head stopped: Another worker (process {os.getpid()}" in ran.stdout
            and ran.stdout.splitlines()[-1] == "2 faces: 1 done, 1 stopped"
        )
    assert states(batch) == {"a": TO_DO, "b": DONE}


def test_a_machine_that_has_gone_holds_nothing(code, tmp_path, monkeypatch):
    """Its lease is waited for and taken over, its face gone on with."""
    batch = make(code, tmp_path, "a")
    capture = batch.faces[0].capture
    capture.lock.write_text(
        json.dumps({"host": "gone/1/2", "pid": 1, "began": "", "since": "2026-11-24T00:00:00", "token": "x"})
    )
    assert derive_state(batch, batch.faces[0]).machine == "gone"
    monkeypatch.setattr(lease, "TERM_S", 0.5)
    heard = []
    monkeypatch.setattr("core.batch.task.ROOT", code)
    tally = local.run_local(batch, batch.faces, 1, False, heard.append)
    assert tally.ended == {"a": DONE} and states(batch) == {"a": DONE}, heard


def test_a_batch_is_run_by_one_at_a_time(code, tmp_path):
    batch = make(code, tmp_path, "a")
    with lease.hold(batch.root, folder_kind="batch"):
        ran = core(code, "batch", "run", batch.root)
        assert (
            ran.returncode == 2
            and "is working on this batch" in ran.stderr
            and "stages" in batch.faces[0].capture.read()
        )
        assert f"process {os.getpid()}" in core(code, "batch", "status", batch.root).stdout


def test_the_gate_waits_for_each_mask(code, tmp_path):
    batch = make(code, tmp_path, "ab", None, "--gate", "artist")
    assert core(code, "batch", "run", batch.root).stdout.splitlines()[-1] == "2 faces: 2 waiting for the artist"
    assert states(batch) == {"a": WAITING, "b": WAITING} and core(code, "batch", "commands", batch.root).stdout == ""
    refused = core(code, "batch", "task", batch.root, "a", "solve")
    assert (
        refused.returncode == 2
        and "waits to be looked at" in refused.stderr
        and len(refused.stderr.strip().splitlines()) == 2
    )
    assert core(code, "batch", "accept", batch.root, "a").returncode == 0
    assert core(code, "batch", "run", batch.root).stdout.splitlines()[-1] == "2 faces: 1 done, 1 waiting for the artist"
    capture = batch.faces[0].capture
    capture.shadow_mask_auto.write_text("another proposal")
    assert not gate.is_accepted(capture) and states(batch)["a"] != DONE, "another proposal has to be looked at"
    with pytest.raises(Problem, match="no proposed shadow mask"):
        (tmp_path / "other").mkdir()
        gate.accept_mask(make(code, tmp_path / "other", "c").faces[0].capture)


def test_commands_do_the_batch_in_the_order_they_name(code, tmp_path):
    batch = make(code, tmp_path, "ab")
    told = core(code, "batch", "commands", batch.root).stdout.splitlines()
    done = {""}
    for name, after, line in (line.split("\t") for line in told):
        assert after in done, "each waits for one before it"
        assert subprocess.run(shlex.split(line), cwd=code, capture_output=True).returncode == 0
        done.add(name)
    assert done == {
        "",
        *(f"{face}.{group}" for face in "ab" for group in ("head", "mask", "solve", "deliver")),
    } and states(batch) == {"a": DONE, "b": DONE}
    assert [task.name for task in lines.list_tasks(batch)] == []


def test_a_task_by_an_unknown_name_is_refused(code, tmp_path):
    batch = make(code, tmp_path, "a")
    for words, said in ((("z", "head"), "no face named 'z'"), (("a", "lunch"), "no task named 'lunch'")):
        assert said in core(code, "batch", "task", batch.root, *words).stderr
    for words, said in (
        (("--at-once", 0), "less than one"),
        (("--address", "here"), "--on ray only"),
        (("--cores", 2), "--on ray only"),
        (("--on", "ray", "--at-once", 2), "--on local only"),
        (("z",), "no face named"),
    ):
        assert said in core(code, "batch", "run", batch.root, *words).stderr


@pytest.mark.skipif(os.name == "nt", reason="no other process can press Ctrl-C there")
@pytest.mark.parametrize("way", ["ctrl-c", "stop", "killed", "task"])
def test_whatever_ends_it_nothing_is_lost_and_it_goes_on(code, tmp_path, way):
    batch = make(code, tmp_path, "ab", {"a": {"scan": "slow"}})
    words = ("task", batch.root, "a", "head") if way == "task" else ("run", batch.root)
    with tiny_batch.start(code, "batch", *words) as process:
        capture = batch.faces[0].capture
        while not list(capture.root.glob(".scan*")):
            assert process.poll() is None
            time.sleep(0.02)
        if way != "task":
            time.sleep(local.EVERY_S)
            told = json.loads((batch.root / local.PROGRESS).read_text())
            assert told["of"] == 2 and told["ended"] == 0 and told["working"]["a"]["stage"] == "Scan"
        asked = time.monotonic()
        if way == "stop":
            (batch.root / local.STOP).touch()
        else:
            process.send_signal({"ctrl-c": signal.SIGINT, "killed": signal.SIGKILL, "task": signal.SIGTERM}[way])
        process.communicate(timeout=20)
    assert way == "killed" or time.monotonic() - asked < 2.5
    assert process.returncode == {"killed": -9}.get(way, 130)
    deadline = time.monotonic() + 5
    while lease.holder(capture.lock):  # a worker whose starter was killed ends by itself
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert list(capture.read()["stages"]) == ["frames", "cameras"]
    once = finished(batch)["a"]["cameras"]
    tiny_batch.set_mood(capture, {})
    assert core(code, "batch", "run", batch.root).returncode == 0
    assert states(batch) == {"a": DONE, "b": DONE} and finished(batch)["a"]["cameras"] == once


def test_a_stage_that_begins_is_told_at_once_and_how_far_it_is_once_in_a_while(code, tmp_path):
    batch = make(code, tmp_path, "a")
    board, face = local.Board(batch, 1, lambda line: None), batch.faces[0]

    def told() -> tuple[str, float]:
        return tuple(json.loads((batch.root / local.PROGRESS).read_text())["working"]["a"].values())[:2]

    board.write(now=True)
    for stage, done, expected in (
        ("frames", 0, ("Frames", 0)),
        ("frames", 1, ("Frames", 0)),
        ("cameras", 0, ("Cameras", 0)),
    ):
        board.hear(face, Progress(stage, done, 2, "Starting"))
        assert told() == expected


def test_what_somebody_else_named_like_the_request_to_stop_is_no_request_and_stays(code, tmp_path):
    batch = make(code, tmp_path, "a")
    (batch.root / local.STOP).write_text("a list of bus stops")
    assert core(code, "batch", "run", batch.root).returncode == 0
    assert (batch.root / local.STOP).read_text() == "a list of bus stops"
    (batch.root / local.STOP).unlink()
    (batch.root / local.STOP).mkdir()
    assert core(code, "batch", "run", batch.root).returncode == 0 and (batch.root / local.STOP).is_dir()


def test_until_ends_each_face_there(code, tmp_path):
    batch = make(code, tmp_path, "ab")
    assert core(code, "batch", "run", batch.root, "--until", "mask").returncode == 0
    assert {name for stages in finished(batch).values() for name in stages} == {
        "frames",
        "cameras",
        "scan",
        "registration",
        "delight",
        "texture",
        "shadow_mask",
    }


def test_a_batch_travels_with_its_captures(code, tmp_path):
    """The films, the batch and its captures in one folder that another machine sees under another name."""
    (tmp_path / "here").mkdir()
    make(code, tmp_path / "here", "ab")
    core(code, "batch", "run", tmp_path / "here" / "batch")
    shutil.move(tmp_path / "here", tmp_path / "there")
    moved = read_batch(tmp_path / "there" / "batch")
    assert states(moved) == {"a": DONE, "b": DONE} and moved.faces[0].source == tmp_path / "there" / "films" / "a.mp4"
    once = finished(moved)
    assert core(code, "batch", "run", moved.root).returncode == 0 and finished(moved) == once


def test_what_is_delivered_is_what_the_maps_are_now(code, tmp_path):
    batch = make(code, tmp_path, "ab", None, "--deliver", "unreal", "--to", tmp_path / "out")
    assert core(code, "batch", "run", batch.root).returncode == 0 and states(batch) == {"a": DONE, "b": DONE}
    made = sorted((tmp_path / "out").rglob("*.obj"))
    written = [path.relative_to(tmp_path / "out").as_posix() for path in made]
    assert written == ["a/a_head_unreal_obj/a.obj", "b/b_head_unreal_obj/b.obj"]
    made[0].unlink()
    assert states(batch) == {"a": TO_DO, "b": DONE}
    assert core(code, "batch", "run", batch.root).returncode == 0 and made[0].is_file()
    core(code, "run", "-", batch.faces[1].root, "--from", "solve")
    assert states(batch) == {"a": DONE, "b": TO_DO}, "its maps are others since"


def test_contact_sheets_by_the_blender_that_is_named(code, tmp_path):
    """A program in Blender's place that writes the sheet, and two that do not."""
    blender = tmp_path / "blender"
    blender.write_text(
        f"#!{sys.executable}\nimport sys, pathlib\nassert sys.argv[1:4] == ['--command', 'wildcap', "
        "'contact_sheet']\n"
        "folder = pathlib.Path(sys.argv[4], 'renders'); folder.mkdir(exist_ok=True); (folder / "
        "'contact_sheet.png').write_text('sheet')\n"
    )
    blender.chmod(0o755)
    batch = make(code, tmp_path, "a", None, "--blender", blender)
    core(code, "batch", "run", batch.root)
    assert states(batch) == {"a": DONE} and (batch.faces[0].capture.renders / "contact_sheet.png").is_file()
    (batch.faces[0].capture.renders / "contact_sheet.png").unlink()
    blender.write_text("#!/bin/sh\necho broken; exit 3\n")
    assert "rendered no contact sheet" in core(code, "batch", "run", batch.root).stdout
    assert (batch.faces[0].capture.logs / "contact_sheet.log").read_text() == "broken\n"
    blender.unlink()
    assert "could not be started" in core(code, "batch", "run", batch.root).stdout


def test_a_progress_file_that_cannot_be_written_keeps_nobody(code, tmp_path):
    batch = make(code, tmp_path, "a")
    (batch.root / local.PROGRESS).mkdir()
    assert core(code, "batch", "run", batch.root).returncode == 0 and states(batch) == {"a": DONE}


def test_a_second_look_reads_only_what_has_changed(code, tmp_path, monkeypatch):
    batch = make(code, tmp_path, "ab")
    core(code, "batch", "run", batch.root)
    core(code, "batch", "status", batch.root)
    read = []

    def hash_whole(file, size):
        read.append(Path(file.name))
        return hashlib.file_digest(file, hashes._hasher).hexdigest()

    monkeypatch.setattr(hashes, "_hash_whole", hash_whole)
    monkeypatch.setattr(hashes, "_hashes", {})
    monkeypatch.setattr(hashes._hash_whole, "__name__", "_hash_whole")
    (batch.faces[0].capture.texture).write_text("edited")
    with known_hashes(batch.root):
        assert states(batch) == {"a": TO_DO, "b": DONE}
    assert [path for path in read if path.is_relative_to(batch.root)] == [batch.faces[0].capture.texture]
    for damaged in ("{", "[1]", '[["_hash_whole", "x", 1, 2, 3]]', '{"a": 1}'):
        (batch.root / "hashes.json").write_text(damaged)
        assert core(code, "batch", "status", batch.root).stdout.splitlines()[-1] == "1 to do, 1 done"
