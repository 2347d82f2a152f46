# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lock of a capture: never two inside, the dead replaced at once, the sleeping after a term, and who was replaced
writes nothing more."""

import errno
import json
import os
import signal
import threading
import time
from pathlib import Path

import pytest

from core.capture import lease, processes
from core.capture.capture import Capture
from core.capture.files import replacing, write_json
from core.capture.messages import CancelledError, Problem
from core.worker.job import wait_until_free, write_job
from tests.fixtures.kept_capture import NO_PROCESS, fork, make, needs_fork

RACES = int(os.environ.get("WILDCAP_RACES", 20))


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "a.wildcap")


@pytest.fixture
def soon(monkeypatch):
    monkeypatch.setattr(lease, "TERM_S", 0.5)


def written_by(**changed) -> str:
    return json.dumps({**processes.identify_process(), "since": "2026-11-22T00:00:00", "token": "another", **changed})


def test_a_worker_that_is_at_work_is_refused_at_once_by_name(capture):
    with capture.locked():
        began = time.monotonic()
        for attempt in (Capture(capture.root).locked().__enter__, capture.check_free):
            with pytest.raises(Problem, match=f"process {os.getpid()}"):
                attempt()
        assert time.monotonic() - began < 1
    assert not capture.lock.exists()
    capture.check_free()


@pytest.mark.parametrize(
    "changed",
    [
        {"pid": NO_PROCESS},
        {"began": "long ago"},  # its number went to another process
        {"host": processes.name_host().partition("/")[0] + "/00000000/1"},  # the machine was started again
    ],
    ids=str,
)
def test_one_that_has_ended_is_replaced_at_once(capture, changed):
    capture.lock.write_text(written_by(**changed))
    began = time.monotonic()
    with capture.locked():
        assert json.loads(capture.lock.read_text())["pid"] == os.getpid()
    assert time.monotonic() - began < 2


@pytest.mark.parametrize("text", ["", '{"pid": 1', "[]", "another machine"])
def test_an_empty_lock_is_being_made_and_another_machine_s_is_waited_for(capture, soon, text):
    capture.lock.write_text(written_by(host=text) if text == "another machine" else text)
    began = time.monotonic()
    with capture.locked():
        assert time.monotonic() - began > 0.5, "no refresh for a whole term, by our own clock"
    assert not capture.lock.exists()


@needs_fork
def test_one_that_was_killed_while_it_took_a_lease_over_leaves_nothing_beside_it(capture, monkeypatch):
    """Between putting the dead one's lease aside and removing it: nobody who comes later has to take over anything."""
    capture.lock.write_text(written_by(pid=NO_PROCESS))

    def take_over():
        lease.Path.unlink = lambda *_, **__: os._exit(9)
        lease.hold_file(capture.lock).__enter__()

    os.waitpid(fork(take_over), 0)
    assert len(list(capture.root.glob("lock*"))) == 2
    (capture.root / "lock.txt").write_text("mine")
    with capture.locked():
        assert {path.name for path in capture.root.glob("lock*")} == {"lock", "lock.txt"}


def test_a_refresh_that_is_seen_keeps_the_lease_whatever_its_time(capture, monkeypatch):
    monkeypatch.setattr(lease, "TERM_S", 3.0)
    capture.lock.write_text(written_by(host="another machine"))
    beat = threading.Timer(0.5, os.utime, (capture.lock, (5, 5)))
    beat.start()
    with pytest.raises(Problem, match="another machine"), capture.locked():
        pass
    beat.join()
    assert capture.lock.exists()


def test_a_wait_for_another_machine_is_cancelled_and_ends_by_itself_before_a_command(capture, soon):
    capture.lock.write_text(written_by(host="another machine"))
    began = time.monotonic()
    with pytest.raises(CancelledError), capture.locked(cancelled=lambda: True):
        pass
    assert time.monotonic() - began < 0.4 and capture.lock.exists()
    wait_until_free(capture, lambda text: None)
    assert not capture.lock.exists()
    wait_until_free(capture, lambda text: None)  # nobody is here


@pytest.mark.parametrize("left", ["", "another machine", "in another container"])
def test_a_job_can_be_given_to_a_worker_that_will_take_over_what_was_left_long_ago(capture, soon, left):
    """As by a Blender that was closed in the middle of a job, in a container that is another one each time."""
    text = left and written_by(host="another machine" if left == "another machine" else processes.name_host() + "0")
    capture.lock.write_text(text)
    with pytest.raises(Problem, match="nother worker"):
        write_job(capture)
    assert not capture.job.exists() and lease.present_holder(capture.lock) is not None
    os.utime(capture.lock, (0, time.time() - 1))
    assert lease.present_holder(capture.lock) is None and lease.holder(capture.lock) is not None
    write_job(capture)
    assert capture.lock.read_text() == text, "who takes it over waits for a term of its own"
    with capture.locked():
        os.utime(capture.lock, (0, 0))
        with pytest.raises(Problem, match=f"process {os.getpid()}"):
            write_job(capture)


def test_a_disk_that_does_not_answer_for_a_moment_costs_nobody_the_lease(capture, monkeypatch):
    def away(path):
        raise OSError(errno.EIO, "the server is away", str(path))

    with capture.locked():
        with monkeypatch.context() as patched:
            patched.setattr(lease, "require_regular", away)
            with pytest.raises(Problem, match="could not be written"):  # of the disk, not of another worker
                write_json(capture.root / "texture.json", 1)
        write_json(capture.root / "texture.json", 1)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a disk that is always full")
def test_a_lock_that_does_not_fit_on_the_disk_is_not_left_behind(capture, monkeypatch):
    monkeypatch.setattr(
        lease, "open", lambda descriptor, mode: os.close(descriptor) or open("/dev/full", mode), raising=False
    )
    with pytest.raises(Problem, match="disk is full"), capture.locked():
        pass
    assert not capture.lock.exists()


def test_the_holder_refreshes_and_gives_back_only_its_own(capture, soon):
    with capture.locked():
        before = capture.lock.stat().st_mtime_ns
        deadline = time.monotonic() + 5
        while capture.lock.stat().st_mtime_ns == before:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        capture.lock.write_text(written_by(host="another machine"))
    assert "another machine" in capture.lock.read_text()


def test_who_was_replaced_writes_nothing_more(capture):
    def write_deep():
        with replacing(capture.root / "deep" / "new.txt") as temporary:
            temporary.write_text("x")

    def contents() -> dict:
        files = [path for path in capture.root.iterdir() if path.is_file() and path.name != "written.jsonl"]
        return {path: path.read_bytes() for path in files}

    with capture.locked():
        write_json(capture.root / "texture.json", 1)
        capture.lock.write_text(written_by())
        before = contents()
        for attempt in (
            lambda: write_json(capture.root / "texture.json", 2),
            lambda: capture.stop("x", Problem("a", "b")),
            write_deep,
        ):
            with pytest.raises(Problem, match="capture over"):
                attempt()
        assert contents() == before


@needs_fork
def test_a_worker_that_was_stopped_is_replaced_after_a_term_and_stays_out_when_it_awakes(capture, soon):
    reading, writing = os.pipe()

    def count_up():
        with capture.locked():
            os.write(writing, b"in")
            try:
                for count in range(10_000):
                    write_json(capture.root / "count.json", count)
                    time.sleep(0.01)
            except Problem as problem:
                os.write(writing, problem.problem.encode())

    other = fork(count_up)
    assert os.read(reading, 2) == b"in"
    time.sleep(0.3)
    os.kill(other, signal.SIGSTOP)
    os.waitpid(other, os.WUNTRACED)
    try:
        with capture.locked():
            write_json(capture.root / "count.json", "ours")
            os.kill(other, signal.SIGCONT)
            assert b"capture over" in os.read(reading, 1000)
            os.waitpid(other, 0)
            other = None
            assert (capture.root / "count.json").read_text() == '"ours"'
            assert capture.lock.exists(), "it gives back nothing that is ours"
    finally:
        os.close(reading)
        os.close(writing)
        if other is not None:
            os.kill(other, signal.SIGKILL)
            os.waitpid(other, 0)


@needs_fork
@pytest.mark.parametrize("beginning", ["free", "dead"])
def test_never_two_inside(capture, beginning):
    """RACES times, all at once: three processes that want in, from nothing or over a dead one's lock."""
    inside = capture.root / "inside"

    def enter() -> int:
        try:
            with lease.hold_file(capture.lock):
                os.close(os.open(inside, os.O_CREAT | os.O_EXCL))
                os.unlink(inside)
                return 0
        except FileExistsError:
            return 1
        except Problem:
            return 2

    for race in range(RACES // 2):
        if beginning == "dead":
            capture.lock.write_text(written_by(pid=NO_PROCESS))
        ready, go = os.pipe()

        def run(ready=ready, go=go):
            os.close(go)
            os.read(ready, 1)  # end of file: all at once
            os._exit(enter())

        children = [fork(run) for _ in range(3)]
        os.close(go)
        os.close(ready)
        codes = [os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) for pid in children]
        assert 0 in codes and 1 not in codes, f"{codes} in race {race}"
        assert not list(capture.root.glob("lock*"))


NO_PIPES = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")


@pytest.mark.parametrize("kind", ["dangling link", "link to itself", "folder", pytest.param("pipe", marks=NO_PIPES)])
def test_what_is_no_lock_is_refused_by_name_and_not_waited_for(capture, kind):
    if kind == "folder":
        capture.lock.mkdir()
    elif kind == "pipe":
        os.mkfifo(capture.lock)
    else:
        capture.lock.symlink_to("nowhere" if kind == "dangling link" else capture.lock.name)
    for attempt in (capture.check_free, capture.locked().__enter__):
        with pytest.raises(Problem, match="in the way"):
            attempt()
    assert os.path.lexists(capture.lock)
