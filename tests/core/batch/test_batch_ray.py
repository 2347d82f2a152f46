# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches on Ray, over the tiny chain: what dies is done again, what was done is not, and whatever is lacking is told in
one line.

One Ray cluster of this machine serves all tests; nodes that die are tried over a stand-in for Ray."""

import collections
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from unittest import mock

import pytest

from core import __version__
from core.__main__ import main
from core.batch import local, ray_cluster, ray_connection, ray_task
from core.batch.groups import GROUPS, group_named
from core.batch.record import NAME
from core.batch.state import DONE, STOPPED, TO_DO, WAITING, FaceState
from core.capture import lease
from core.capture.hashes import hash_file
from core.capture.messages import Problem
from tests.fixtures import tiny_batch
from tests.fixtures.polled_jobs import wait
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_batch import core, finish, finished, lines, make, set_mood, states

WAIT_S = 90  # for what takes seconds where nothing else is computed


@pytest.fixture(scope="module")
def ray(code):
    """Ray, connected to a cluster of this machine; what it is told by the environment ends with these tests."""
    with pytest.MonkeyPatch.context() as environment:
        for name in (*ray_connection.QUIET, "RAY_AUTH_MODE", "RAY_AUTH_TOKEN", "RAY_ADDRESS"):
            environment.setenv(name, "")
            environment.delenv(name)
        environment.setenv("RAY_worker_niceness", "0")
        with ray_connection.connect(None) as connected:
            yield connected


@pytest.fixture
def cluster(code, ray, monkeypatch):
    """Batches run on that cluster, by the tiny stages."""
    monkeypatch.setattr(ray_cluster, "ROOT", code)
    monkeypatch.setattr(ray_cluster, "connect", lambda address: contextlib.nullcontext(ray))
    return ray


@contextlib.contextmanager
def meanwhile(work):
    """Does something in a thread beside the block, and ends with it."""
    errors = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    yield
    thread.join(WAIT_S)
    assert not errors, errors


def account(batch) -> list[dict]:
    """What the nodes say that they began and finished."""
    paths = (batch.root / ray_task.LOGS).glob("*.jsonl")
    told = [json.loads(line) for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    return sorted(told, key=lambda line: line["at"])


def at_stage(batch, face: str, stage: str) -> list[dict]:
    return [line for line in account(batch) if (line["face"], line["stage"]) == (face, stage)]


@pytest.mark.skipif(os.name == "nt", reason="no signal ends a process there")
def test_a_killed_task_is_done_again_and_nothing_that_was_done(code, cluster, tmp_path, capfd):
    """Of five faces one stops at its own fault, one has no video, one is worked on elsewhere, one loses its process, one
    had been done before."""
    batch = make(tmp_path, "abcde", {"a": {"scan": "slow"}, "b": {"scan": "finding"}})
    finish(batch.face("e"), "shadow_mask")
    (tmp_path / "films" / "c.mp4").unlink()
    once = finished(batch)["e"]

    def kill() -> None:
        wait(lambda: at_stage(batch, "a", "scan"), WAIT_S)
        set_mood(batch.face("a").capture, {})
        os.kill(at_stage(batch, "a", "scan")[0]["pid"], signal.SIGKILL)

    with batch.face("d").capture.locked(), meanwhile(kill):
        ran = core(code, "batch", "run", batch.root, "--on", "ray", "--cores", 1, "--until", "mask")
    said = lines(ran.stdout)
    assert ran.returncode == 2 and ran.stdout.splitlines()[-1] == "5 faces: 2 done, 3 stopped", ran.stdout
    assert ran.stderr == "" and capfd.readouterr() == ("", ""), "nothing of Ray's own"
    assert "head stopped: The face is not there. Film it." in said["b"] and "There is no video" in said["c"]
    assert f"Another worker (process {os.getpid()}" in said["d"]
    assert states(batch) == dict.fromkeys("acde", TO_DO) | {"b": STOPPED} and finished(batch)["e"] == once
    begun, done = (
        collections.Counter((line["face"], line["stage"]) for line in account(batch) if line["finished"] is whether)
        for whether in (False, True)
    )
    assert set(done.values()) == {1} and len(done) == 7 + 2, "each stage once"
    again = {stage: count for stage, count in begun.items() if count > done[stage]}
    assert again == {("a", "scan"): 2, ("b", "scan"): 1}, "but for what was killed"


@pytest.mark.skipif(os.name == "nt", reason="no other process can press Ctrl-C there")
@pytest.mark.parametrize("way", ["ctrl-c", "stop"])
def test_it_is_cancelled_within_two_seconds(code, cluster, tmp_path, way):
    """One stage that reports, one that is deaf, and one face that waits for a core."""
    batch = make(tmp_path, "abc", {"a": {"scan": "slow"}, "b": {"scan": "deaf"}, "c": {"scan": "slow"}})
    captures, took = [face.capture for face in batch.faces], []

    def cancel() -> None:
        wait(lambda: sum(any(c.root.glob(".scan*")) for c in captures) >= min(2, os.cpu_count()), WAIT_S)
        wait(lambda: local_progress(batch).get("a", {}).get("stage") == "Scan", WAIT_S)
        began = time.monotonic()
        if way == "stop":
            (batch.root / local.STOP).touch()
        else:
            os.kill(os.getpid(), signal.SIGINT)
        wait(lambda: not any(lease.holder(capture.lock) for capture in captures), WAIT_S)
        took.append(time.monotonic() - began)

    with meanwhile(cancel):
        ran = core(code, "batch", "run", batch.root, "--on", "ray", "--cores", 1, "--until", "head")
    assert ran.returncode == 130 and ran.stderr == "" and "a: cancelled" in ran.stdout, ran.stdout
    assert took[0] < 2.5 and list(finished(batch)["a"]) == ["frames", "cameras"]


def local_progress(batch) -> dict:
    return json.loads((batch.root / local.PROGRESS).read_text(encoding="utf-8"))["working"]


def test_the_gate_waits_and_a_cluster_that_cannot_work_is_refused(code, cluster, tmp_path, monkeypatch):
    batch = make(tmp_path, "ab", None, "--gate", "artist")
    finish(batch.face("a"), "shadow_mask")
    finish(batch.face("b"), "texture")
    refuses("No node of the cluster has 1000 cores and 5 GB", ray_cluster._examine_nodes, cluster, batch, 1000)
    with monkeypatch.context() as elsewhere, pytest.raises(Problem, match=f"{tmp_path / 'none'}. Set WILDCAP_CODE"):
        elsewhere.setattr(ray_cluster, "ROOT", tmp_path / "none")
        ray_cluster._examine_nodes(cluster, batch, 1)
    ended = ray_cluster.run_on_ray(batch, batch.faces, False, print, None, None, 1)
    assert ended == dict.fromkeys("ab", WAITING) and states(batch) == dict.fromkeys("ab", WAITING)


def test_a_face_whose_node_is_given_up_is_begun_elsewhere(tmp_path):
    """Over a stand-in for Ray, of which a node falls silent."""
    batch, ray = make(tmp_path, "a"), mock.MagicMock()
    begin = ray.remote.return_value.options.return_value.remote
    begin.side_effect = lambda *words: object()
    ray.exceptions.RayError = ray.exceptions.RayTaskError = RuntimeError
    ray.cluster_resources.return_value, ray.wait.return_value = {"CPU": 2}, ([], [])
    ray.nodes.return_value = [{"NodeID": "here", "Alive": True}, {"NodeID": "silent", "Alive": False}]
    run = ray_cluster._Run(ray, batch, list(batch.faces), False, mock.MagicMock(), None, 1)
    with batch.faces[0].capture.locked():
        stranger = lease.holder(batch.faces[0].capture.lock)["token"]
        run.advance()
        first = dict(run._tasks)
        assert [group for _, group in first.values()] == list(GROUPS) and begin.call_args.args[-1] == stranger
        for node, left in (("here", False), ("silent", True)):
            run._places = {"a": node}
            run._leave_dead_nodes({"a": batch.faces[0]})
            assert (set(run._tasks) == set(first)) != left
    assert [call.args[0] for call in ray.cancel.call_args_list] == list(first) and len(run._tasks) == len(GROUPS)
    assert begin.call_args.args[-1] == "" and run._places == {}, "who has the capture now is a task of ours"
    (ref, *_), ray.get.return_value = run._tasks, {"state": STOPPED, "words": "It broke."}
    run._take(ref, *run._tasks.pop(ref))
    assert not run._tasks and run.board.end.call_args.args == (batch.faces[0], STOPPED, "head stopped: It broke.")


def test_what_a_node_lacks(tmp_path, monkeypatch):
    batch = make(tmp_path, "a")
    record = hash_file(batch.root / NAME)
    assert ray_task.examine(str(batch.root), __version__, record) == ""
    assert f"has WildCap {__version__}, and this is 0.0" in ray_task.examine(str(batch.root), "0.0", record)
    assert "another batch" in ray_task.examine(str(batch.root), __version__, "0" * 64)
    assert "There is no batch at" in ray_task.examine(str(tmp_path / "none"), __version__, record)
    monkeypatch.setenv(ray_task.BATCHES, str(tmp_path))
    told = ray_task.examine(f"/seen/elsewhere/{batch.root.name}", __version__, record)
    assert told == "", "the node's own name of the folder"
    monkeypatch.setattr(ray_task.importlib.util, "find_spec", lambda name: None)
    assert "has no torch" in ray_task.examine(str(batch.root), __version__, record)
    assert ray_task.do_task(str(tmp_path / "none"), "a", "head", 1, "", print)["state"] == STOPPED


def test_a_task_whose_result_is_not_what_was_asked_for(code, tmp_path, monkeypatch):
    batch = make(tmp_path, "a")
    monkeypatch.setattr("core.batch.task.ROOT", code)
    monkeypatch.setattr(local, "derive_state", lambda *task: FaceState(TO_DO, group_named("head")))
    assert "not what was asked for" in ray_task.do_task(str(batch.root), "a", "head", 1, "", lambda line: None)["words"]


def test_a_task_of_ours_that_died_is_waited_for(code, tmp_path, monkeypatch):
    """The worker of a process that was killed is at work for a moment longer; who was there when the batch came is not
    waited for."""
    batch = make(tmp_path, "a")
    capture = batch.faces[0].capture
    monkeypatch.setattr("core.batch.task.ROOT", code)
    words = str(batch.root), "a", "head", 1
    hold = (
        "import sys; from core.capture.capture import Capture\nwith Capture(sys.argv[1]).locked(): "
        "print(flush=True); input()"
    )
    holding = [sys.executable, "-c", hold, capture.root]
    with subprocess.Popen(holding, cwd=code, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        began = time.monotonic()
        refused = ray_task.do_task(*words, lease.holder(capture.lock)["token"], print)
        assert "is working on this capture" in refused["words"] and time.monotonic() - began < lease.TERM_S
        with monkeypatch.context() as short:
            short.setattr(lease, "TERM_S", 0.3)
            told = ray_task.do_task(*words, "", print)
            assert "is working on this capture" in told["words"], "it is alive, after all"
        threading.Timer(1, process.kill).start()
        assert ray_task.do_task(*words, "", lambda line: None)["state"] == DONE


def test_an_address_that_cannot_be_reached_is_told_in_seconds(code, tmp_path, capsys, monkeypatch):
    batch = make(tmp_path, "a")
    with socket.create_server(("127.0.0.1", 0)) as deaf:  # takes connections and never answers
        address = f"127.0.0.1:{deaf.getsockname()[1]}"
        with tiny_batch.start(code, "batch", "run", batch.root, "--on", "ray", "--address", address) as process:
            _, err = process.communicate(timeout=30)  # 15 s, and what it takes to import Ray on a busy machine
        assert process.returncode == 2 and "No Ray cluster can be reached" in err and len(err.splitlines()) == 2, err
    for wrong, said in ((address, "Connection refused"), ("here", "not the address of")):
        refuses(said, ray_connection._reach, wrong)
    refuses(
        "could not be started on this machine: It took too long.",
        ray_connection._begin,
        mock.Mock(side_effect=Exception("It took too long.\nMore of it.")),
    )
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["batch", "run", str(batch.root), "--on", "ray"]) == 2
    assert "requirements/farm.txt" in capsys.readouterr().err
