# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches over the tiny chain: what is done is done once, what fails is told in one line, and the rest goes on."""

import hashlib
import json
import os
import shutil
import signal
import time
from pathlib import Path

import pytest

from core.batch import gate, local
from core.batch.known_hashes import known_hashes
from core.batch.record import read_batch
from core.batch.state import DONE, STOPPED, TO_DO, WAITING, derive_state
from core.capture import hashes, lease, tone_choice
from core.capture.files import write_json
from core.capture.messages import Progress
from core.capture.stages import NAMES
from tests.fixtures import tiny_batch
from tests.fixtures.polled_jobs import wait
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_batch import core, finish, finished, lines, make, set_mood, states


def test_a_batch_is_done_once(code, tmp_path):
    batch = make(tmp_path)
    assert states(batch) == dict.fromkeys("ab", TO_DO)
    finish(batch.face("b"), "shadow_mask")
    ran = core(code, "batch", "run", batch.root, "--at-once", 2)
    assert ran.returncode == 0 and ran.stdout.splitlines()[-1] == "2 faces: 2 done", ran.stdout + ran.stderr
    assert states(batch) == dict.fromkeys("ab", DONE)
    once = finished(batch)
    assert core(code, "batch", "run", batch.root).returncode == 0 and finished(batch) == once
    assert not lease.holder(batch.root / "lock") and core(code, "batch", "commands", batch.root).stdout == ""
    told = core(code, "batch", "status", batch.root).stdout.splitlines()
    assert [line.split() for line in told] == [["a", "done"], ["b", "done"], ["2", "done"]]


def test_one_that_stops_keeps_nobody(code, tmp_path):
    """b stops at its own fault, c at a full disk, and d has no film."""
    batch, until = make(tmp_path, "abcd", {"b": {"cameras": "finding"}, "c": {"scan": "full"}}), ("--until", "head")
    (tmp_path / "films" / "d.mp4").unlink()
    ran = core(code, "batch", "run", batch.root, *until)
    said = lines(ran.stdout)
    assert ran.returncode == 2 and ran.stderr == "" and ran.stdout.splitlines()[-1] == "4 faces: 1 done, 3 stopped"
    assert "head stopped: The face is not there. Film it." in said["b"] and "The disk is full" in said["c"]
    assert "There is no video or folder at" in said["d"]
    assert states(batch) == {"a": TO_DO, "b": STOPPED, "c": TO_DO, "d": TO_DO}, (
        "a disk with room again, a film that is back: nobody has to say so"
    )
    for face in batch.faces:
        set_mood(face.capture, {})
    (tmp_path / "films" / "d.mp4").write_bytes(b"d")
    once = finished(batch)
    assert core(code, "batch", "run", batch.root, *until).returncode == 2
    assert states(batch)["b"] == STOPPED, "what has stopped at a face's own fault is not tried again by itself"
    assert core(code, "batch", "retry", batch.root, "b", *until).returncode == 0
    assert finished(batch)["a"] == once["a"] and finished(batch)["b"]["frames"] == once["b"]["frames"]
    assert all(list(done) == list(NAMES[:4]) for done in finished(batch).values())


def test_a_worker_that_dies_is_started_once_more(code, tmp_path):
    """It may have been killed for the memory that the one beside it took; one that dies again stops its face."""
    batch = make(tmp_path, "ab", {"a": {"scan": "die once"}, "b": {"scan": "die"}})
    ran = core(code, "batch", "run", batch.root, "--until", "head")
    assert ran.stdout.splitlines()[-1] == "2 faces: 1 done, 1 stopped"
    assert "head stopped: " in lines(ran.stdout)["b"] and "exit code 9" in lines(ran.stdout)["b"]
    assert "scan" in batch.face("a").capture.read()["stages"]


def test_a_machine_that_has_gone_is_named(tmp_path):
    batch = make(tmp_path, "a")
    capture = batch.faces[0].capture
    gone = {"host": "gone/1/2", "pid": 1, "began": "", "since": "2026-11-24T00:00:00", "token": "x"}
    capture.lock.write_text(json.dumps(gone))
    assert derive_state(batch, batch.faces[0]).machine == "gone"


def test_a_batch_is_run_by_one_at_a_time(code, tmp_path):
    batch = make(tmp_path, "a")
    with lease.hold_file(batch.root / "lock", folder_kind="batch"):
        ran = core(code, "batch", "run", batch.root)
        assert ran.returncode == 2 and "is working on this batch" in ran.stderr
        assert f"process {os.getpid()}" in core(code, "batch", "status", batch.root).stdout
    assert not batch.faces[0].capture.read()["stages"]


def test_the_gate_waits_for_each_mask(code, tmp_path):
    batch = make(tmp_path, "ab", None, "--gate", "artist")
    for face in batch.faces:
        finish(face, "shadow_mask")
    assert core(code, "batch", "run", batch.root).stdout.splitlines()[-1] == "2 faces: 2 waiting for the artist"
    assert states(batch) == {"a": WAITING, "b": WAITING} and core(code, "batch", "commands", batch.root).stdout == ""
    refused = core(code, "batch", "task", batch.root, "a", "solve")
    assert refused.returncode == 2 and "waits for review" in refused.stderr
    assert core(code, "batch", "accept", batch.root, "a").returncode == 0
    assert core(code, "batch", "run", batch.root).stdout.splitlines()[-1] == "2 faces: 1 done, 1 waiting for the artist"
    capture = batch.face("a").capture
    capture.shadow_mask_auto.write_text("another proposal")
    assert not gate.is_accepted(capture) and states(batch)["a"] != DONE, "another proposal has to be looked at"
    capture.shadow_mask_auto.unlink()
    refuses("no proposed shadow mask", gate.accept_mask, capture)


@pytest.mark.parametrize(
    "words, said",
    [
        (("task", "z", "head"), "no face named 'z'"),
        (("task", "a", "lunch"), "no task named 'lunch'"),
        (("run", "--at-once", 0), "less than one"),
        (("run", "--address", "here"), "--on ray only"),
        (("run", "--cores", 2), "--on ray only"),
        (("run", "--on", "ray", "--cores", 0), "less than one"),
        (("run", "--on", "ray", "--at-once", 2), "--on local only"),
        (("run", "z"), "no face named"),
    ],
)
def test_what_is_not_there_is_refused(code, tmp_path, words, said):
    batch = make(tmp_path, "a")
    ran = core(code, "batch", words[0], batch.root, *words[1:])
    assert ran.returncode == 2 and said in ran.stderr


@pytest.mark.skipif(os.name == "nt", reason="no signal ends a process there")
@pytest.mark.parametrize("way", ["stop", "killed", "task"])
def test_whatever_ends_it_nothing_is_lost_and_it_goes_on(code, tmp_path, way):
    batch = make(tmp_path, "a", {"a": {"scan": "slow"}})
    words = ("task", batch.root, "a", "head") if way == "task" else ("run", batch.root)
    with tiny_batch.start(code, "batch", *words) as process:
        capture = batch.faces[0].capture
        while not list(capture.root.glob(".scan*")):
            assert process.poll() is None
            time.sleep(0.02)
        if way == "stop":
            time.sleep(local.EVERY_S)
            told = json.loads((batch.root / local.PROGRESS).read_text())
            assert told["of"] == 1 and told["ended"] == 0 and told["working"]["a"]["stage"] == "Scan"
        began = time.monotonic()
        if way == "stop":
            (batch.root / local.STOP).touch()
        else:
            process.send_signal(signal.SIGKILL if way == "killed" else signal.SIGTERM)
        process.communicate(timeout=20)
    assert way == "killed" or time.monotonic() - began < 2.5
    assert process.returncode == {"killed": -9}.get(way, 130)
    wait(lambda: not lease.holder(capture.lock), 5)  # a worker whose starter was killed ends by itself
    once = finished(batch)["a"]
    assert list(once) == ["frames", "cameras"]
    if way in ("killed", "stop"):
        set_mood(capture, {})
        assert core(code, "batch", "run", batch.root, "--until", "head").returncode == 0
        assert finished(batch)["a"]["cameras"] == once["cameras"] and "scan" in finished(batch)["a"]


def test_a_stage_that_begins_is_told_at_once_and_how_far_it_is_once_in_a_while(tmp_path):
    batch = make(tmp_path, "a")
    board = local.Board(batch, 1, lambda line: None)
    board.write(now=True)
    for stage, done, expected in (
        ("frames", 0, ["Frames", 0]),
        ("frames", 1, ["Frames", 0]),
        ("cameras", 0, ["Cameras", 0]),
    ):
        board.hear(batch.faces[0], Progress(stage, done, 2, "Starting"))
        working = json.loads((batch.root / local.PROGRESS).read_text())["working"]["a"]
        assert [working["stage"], working["share"]] == expected


def test_other_files_under_the_names_of_ours_keep_nobody_and_stay(code, tmp_path):
    batch = make(tmp_path, "a")
    (batch.root / local.PROGRESS).mkdir()
    (batch.root / local.STOP).write_text("a list of bus stops")
    ran = core(code, "batch", "run", batch.root, "--until", "head")
    assert ran.returncode == 0 and list(finished(batch)["a"]) == list(NAMES[:4])
    assert (batch.root / local.STOP).read_text() == "a list of bus stops"


def test_a_batch_travels_with_its_captures(tmp_path):
    """The films, the batch and its captures in one folder that another machine sees under another name."""
    finish(make(tmp_path / "here", "a").faces[0])
    shutil.move(tmp_path / "here", tmp_path / "there")
    moved = read_batch(tmp_path / "there" / "batch")
    assert states(moved) == {"a": DONE} and moved.faces[0].source == tmp_path / "there" / "films" / "a.mp4"


def test_what_is_delivered_is_what_the_maps_are_now(code, tmp_path):
    batch = make(tmp_path, "ab", None, "--deliver", "unreal", "--to", tmp_path / "out")
    for face in batch.faces:
        finish(face)
    assert core(code, "batch", "run", batch.root).returncode == 0 and states(batch) == {"a": DONE, "b": DONE}
    made = sorted((tmp_path / "out").rglob("*.obj"))
    written = [path.relative_to(tmp_path / "out").as_posix() for path in made]
    assert written == ["a/a_head_unreal_obj/a.obj", "b/b_head_unreal_obj/b.obj"]
    made[0].unlink()
    assert states(batch) == {"a": TO_DO, "b": DONE}
    assert core(code, "batch", "run", batch.root).returncode == 0 and made[0].is_file()
    record = batch.face("b").capture.read()
    record["stages"]["solve"]["finished"] = "2026-01-01T00:00:00"
    write_json(batch.face("b").capture.json, record)
    assert states(batch) == {"a": DONE, "b": TO_DO}, "its maps are others since"
    record = batch.face("a").capture.read()
    record["stages"]["solve"]["figures"] = {"skin_tone_srgb": [0.5, 0.4, 0.3], "skin_tone_source": "scene"}
    write_json(batch.face("a").capture.json, record)
    assert states(batch)["a"] == DONE
    tone_choice.write_choice(batch.face("a").capture, "6")
    assert states(batch)["a"] == TO_DO, "its skin tone is another since"
    tone_choice.write_choice(batch.face("a").capture, "auto")
    assert states(batch)["a"] == DONE


def test_contact_sheets_by_the_blender_that_is_named(code, tmp_path):
    """A program in Blender's place that writes the sheet, and two that do not."""
    blender = tmp_path / "blender"
    blender.write_text(
        '#!/bin/sh\n[ "$1 $2 $3" = "--command wildcap contact_sheet" ] && mkdir -p "$4/renders" && '
        'echo sheet > "$4/renders/contact_sheet.png"\n'
    )
    blender.chmod(0o755)
    batch = make(tmp_path, "a", None, "--blender", blender)
    finish(batch.faces[0])
    sheet = batch.faces[0].capture.renders / "contact_sheet.png"
    core(code, "batch", "run", batch.root)
    assert states(batch) == {"a": DONE} and sheet.is_file()
    sheet.unlink()
    blender.write_text("#!/bin/sh\necho broken; exit 3\n")
    assert "rendered no contact sheet" in core(code, "batch", "run", batch.root).stdout
    assert (batch.faces[0].capture.logs / "contact_sheet.log").read_text() == "broken\n"
    blender.unlink()
    assert "could not be started" in core(code, "batch", "run", batch.root).stdout


def test_a_second_look_reads_only_what_has_changed(code, tmp_path, monkeypatch):
    batch, read = make(tmp_path), []

    def hash_whole(file, size):
        read.append(Path(file.name))
        return hashlib.file_digest(file, hashes._hasher).hexdigest()

    def look():
        """In a process that knows nothing yet."""
        monkeypatch.setattr(hashes, "_hashes", {})
        read.clear()
        with known_hashes(batch.root):
            return states(batch)

    for face in batch.faces:
        finish(face)
    monkeypatch.setattr(hashes, "_hash_whole", hash_whole)
    monkeypatch.setattr(hashes._hash_whole, "__name__", "_hash_whole")
    assert look() == {"a": DONE, "b": DONE} and read
    texture = batch.face("a").capture.texture
    texture.write_text("edited")
    assert look() == {"a": TO_DO, "b": DONE}
    assert [path for path in read if path.is_relative_to(batch.root)] == [texture]
    for damaged in ("{", "[1]", '[["_hash_whole", "x", 1, 2, 3]]', '{"a": 1}'):
        (batch.root / "hashes.json").write_text(damaged)
        assert look() == {"a": TO_DO, "b": DONE}
