# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches on Ray, over rooms of a few lines: what dies is done again, what was done is not, and whatever is lacking is
told in one line.

Two nodes in namespaces of their own, real stages, and a node that dies, are `python -m research.benchmarks.farm`."""

import collections
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from core import __version__
from core.__main__ import main
from core.batch import local, ray_cluster, ray_connection, ray_task
from core.batch.groups import group_named
from core.batch.record import NAME, read_batch
from core.batch.state import DONE, STOPPED, TO_DO, WAITING, FaceState
from core.capture import lease, stages
from core.capture.hashes import hash_file
from core.capture.messages import Problem
from core.worker.client import THREAD_VARIABLES
from research.benchmarks import same_maps
from tests.fixtures import tiny_batch, tiny_chain
from tests.fixtures.tiny_batch import core, finished, make, states

ROOT = Path(__file__).resolve().parents[3]
WAIT_S = 90  # for what takes seconds where nothing else is computed


@pytest.fixture(scope="module")
def code(tmp_path_factory):
    return tiny_batch.build(tmp_path_factory.mktemp("tiny"))


@pytest.fixture(autouse=True)
def rays_processes_keep_pace(monkeypatch):
    monkeypatch.setenv("RAY_worker_niceness", "0")


@pytest.fixture
def own_environment(monkeypatch):
    """What Ray is told by the environment ends with the test."""
    for name in (*ray_connection.QUIET, "RAY_AUTH_MODE", "RAY_AUTH_TOKEN", "RAY_ADDRESS"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)


def account(batch) -> list[dict]:
    """What the nodes say that they began and finished."""
    lines = [
        line
        for path in (batch.root / ray_task.LOGS).glob("*.jsonl")
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    return sorted(map(json.loads, lines), key=lambda line: line["at"])


def at_stage(batch, face: str, stage: str) -> list[dict]:
    return [line for line in account(batch) if (line["face"], line["stage"]) == (face, stage)]


def wait_for(condition, process) -> None:
    deadline = time.monotonic() + WAIT_S
    while not condition():
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()
        time.sleep(0.02)


@pytest.mark.skipif(os.name == "nt", reason="no signal ends a process there")
def test_a_killed_task_is_done_again_and_nothing_that_was_done(code, tmp_path):
    """Eight faces: one stops at its own fault, one has no video, one is worked on elsewhere, one loses its process, one
    had been done before."""
    batch = make(code, tmp_path, "abcdefgh", {"a": {"scan": "slow"}, "b": {"scan": "finding"}})
    capture = batch.face("a").capture
    assert core(code, "batch", "run", batch.root, "h").returncode == 0
    once = finished(batch)["h"]
    (tmp_path / "films" / "c.mp4").unlink()
    words = "batch", "run", batch.root, "--on", "ray", "--cores", 1
    with batch.face("d").capture.locked(), tiny_batch.start(code, *words) as process:
        wait_for(lambda: at_stage(batch, "a", "scan"), process)
        tiny_batch.set_mood(capture, {})
        os.kill(at_stage(batch, "a", "scan")[0]["pid"], signal.SIGKILL)
        out, err = process.communicate(timeout=WAIT_S)
    said = {line.partition(":")[0]: line for line in out.splitlines()}
    assert process.returncode == 2 and err == "" and out.splitlines()[-1] == "8 faces: 5 done, 3 stopped", out + err
    assert set(said) == {*"abcdefgh", "8 faces"}, "nothing of Ray's own"
    assert "head stopped: The face is not there. Film it." in said["b"] and "There is no video" in said["c"]
    assert f"Another worker (process {os.getpid()}" in said["d"]
    assert states(batch) == dict.fromkeys("aefgh", DONE) | {"b": STOPPED, "c": TO_DO, "d": TO_DO}
    assert finished(batch)["h"] == once
    begun, done = (
        collections.Counter((line["face"], line["stage"]) for line in account(batch) if line["finished"] is whether)
        for whether in (False, True)
    )
    assert set(done.values()) == {1} and len(done) == 4 * 10 + 2, "each stage once"
    again = {stage: count for stage, count in begun.items() if count > done[stage]}
    assert again == {("a", "scan"): 2, ("b", "scan"): 1}, "but for what was killed"


@pytest.mark.skipif(os.name == "nt", reason="no other process can press Ctrl-C there")
@pytest.mark.parametrize("way", ["ctrl-c", "stop"])
def test_it_is_cancelled_within_two_seconds_and_goes_on(code, tmp_path, way):
    """One stage that reports, one that is deaf, and one face that waits for a core."""
    batch = make(code, tmp_path, "abc", {"a": {"scan": "slow"}, "b": {"scan": "deaf"}, "c": {"scan": "slow"}})
    captures = [face.capture for face in batch.faces]
    with tiny_batch.start(code, "batch", "run", batch.root, "--on", "ray", "--cores", 1, "--until", "head") as process:
        wait_for(lambda: len(at_work(captures)) >= min(2, os.cpu_count()), process)
        wait_for(lambda: working(batch).get("a", {}).get("stage") == "Scan", process)
        asked = time.monotonic()
        if way == "stop":
            (batch.root / local.STOP).touch()
        else:
            process.send_signal(signal.SIGINT)
        wait_for(lambda: not any(lease.holder(capture.lock) for capture in captures), process)
        took = time.monotonic() - asked
        out, err = process.communicate(timeout=WAIT_S)
    assert took < 2.5 and process.returncode == 130 and err == "" and "a: cancelled" in out, (took, out, err)
    once = finished(batch)["a"]["cameras"]
    for capture in captures:
        tiny_batch.set_mood(capture, {})
    assert core(code, "batch", "run", batch.root, "--until", "head").returncode == 0
    assert finished(batch)["a"]["cameras"] == once


def working(batch) -> dict:
    return json.loads((batch.root / local.PROGRESS).read_text(encoding="utf-8"))["working"]


def at_work(captures) -> list:
    return [capture for capture in captures if list(capture.root.glob(".scan*"))]


def busy_machine(*words, **options) -> None:
    raise Exception("It took too long.\nMore of it.")


def test_the_gate_waits(code, tmp_path, monkeypatch, own_environment):
    """Run by this process, whose sentences are counted: the two refusals of a whole cluster, then the batch."""
    batch = make(code, tmp_path, "ab", None, "--gate", "artist")
    monkeypatch.setattr(ray_cluster, "ROOT", code)
    heard = []
    nowhere = f"has no WildCap at {tmp_path / 'none'}. Set WILDCAP_CODE there"
    with monkeypatch.context() as elsewhere, pytest.raises(Problem, match=nowhere):
        elsewhere.setattr(ray_cluster, "ROOT", tmp_path / "none")
        ray_cluster.run_on_ray(batch, batch.faces, False, heard.append, None, None, 1)
    with pytest.raises(Problem, match="No node of the cluster has 1000 cores and 5 GB"):
        ray_cluster.run_on_ray(batch, batch.faces, False, heard.append, None, None, 1000)
    late = "could not be started on this machine: It took too long."
    with monkeypatch.context() as busy, pytest.raises(Problem, match=late):
        busy.setattr("ray.init", busy_machine)
        ray_cluster.run_on_ray(batch, batch.faces, False, heard.append, None, None, 1)
    assert states(batch) == dict.fromkeys("ab", TO_DO) and not heard
    tally = ray_cluster.run_on_ray(batch, batch.faces, False, heard.append, None, None, 1)
    assert tally.ended == dict.fromkeys("ab", WAITING) and states(batch) == dict.fromkeys("ab", WAITING), heard


def test_what_a_node_lacks(code, tmp_path, monkeypatch):
    batch = make(code, tmp_path, "a")
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
    batch = make(code, tmp_path, "a")
    monkeypatch.setattr("core.batch.task.ROOT", code)
    monkeypatch.setattr(local, "derive_state", lambda *task: FaceState(TO_DO, group_named("head")))
    assert "not what was asked for" in ray_task.do_task(str(batch.root), "a", "head", 1, "", lambda line: None)["words"]


def test_a_task_of_ours_that_died_is_waited_for(code, tmp_path, monkeypatch):
    """The worker of a process that was killed is at work for a moment longer; who was there when the batch came is not
    waited for."""
    batch = make(code, tmp_path, "a")
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


@contextmanager
def deaf_port():
    """A port of this machine that takes connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"127.0.0.1:{server.getsockname()[1]}"


def test_an_address_that_cannot_be_reached_is_told_in_seconds(code, tmp_path, capsys, monkeypatch, own_environment):
    batch = make(code, tmp_path, "a")
    with deaf_port() as address:
        gone = address
        began = time.monotonic()
        told = core(code, "batch", "run", batch.root, "--on", "ray", "--address", address)
        assert time.monotonic() - began < 30 and told.returncode == 2, (
            "15 s, and what it takes to import Ray on a busy machine"
        )
        assert "No Ray cluster can be reached" in told.stderr and len(told.stderr.splitlines()) == 2, told.stderr
    for words, said in (
        (("--address", gone), "Connection refused"),
        (("--address", "here"), "not the address of"),
        (("--cores", "0"), "less than one"),
    ):
        assert main(["batch", "run", str(batch.root), "--on", "ray", *words]) == 2
        assert said in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(["batch", "run", str(batch.root), "--on", "ray"]) == 2
    assert "requirements/farm.txt" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="links to folders take rights there")
def test_real_stages_on_ray_give_the_bytes_of_a_local_run(tmp_path, monkeypatch):
    """One head, from twelve frames of the sample; the whole chain is `python -m research.benchmarks.farm`, for it takes
    40 s of a core a capture."""
    for name in THREAD_VARIABLES:
        monkeypatch.setenv(name, "1")
    code = tmp_path / "code"
    tiny_chain.copy_ground(code / "core")
    for room in {path.name for path in (ROOT / "core").iterdir()} - {*tiny_chain.GROUND, "__pycache__"}:
        (code / "core" / room).symlink_to(ROOT / "core" / room)
    tiny_chain.set_nice(code, 0)
    settings = {
        "device": "cpu",
        "frames": {"max_frames": 12, "long_side": 320, "views": 3},
        "scan": {"pairs": 3, "voxel_mm": 5.0},
        "registration": {"iterations": 2},
    }
    (tmp_path / "small.json").write_text(json.dumps(settings))
    shots = tmp_path / "shots.csv"
    shots.write_text(f"video,name\n{ROOT / 'research/people/sample/capture.mp4'},one\n")
    running = []
    for name, words in (("local", ("--on", "local")), ("ray", ("--on", "ray", "--cores", 1))):
        assert (
            core(code, "batch", "plan", shots, tmp_path / name, "--settings", tmp_path / "small.json").returncode == 0
        )
        running.append(tiny_batch.start(code, "batch", "run", tmp_path / name, "--until", "head", *words))
    for process in running:
        out, err = process.communicate(timeout=400)
        assert process.returncode == 0 and err == "", out + err
    captures = [read_batch(tmp_path / name).faces[0].capture for name in ("local", "ray")]
    written = [
        {file: content for stage in stages.STAGES[:4] for file, content in same_maps.written(capture, stage).items()}
        for capture in captures
    ]
    assert written[0] == written[1] and len(written[0]) > 15
