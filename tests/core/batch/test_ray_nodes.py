# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch on a cluster that was started before it, of which a node falls silent: no connection breaks, and nothing
answers any more."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.batch import ray_task
from core.batch.state import DONE
from tests.fixtures import tiny_batch, tiny_chain
from tests.fixtures.tiny_batch import core, make, states

WAIT_S = 90
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="the processes of a node are found in /proc"
)


@pytest.fixture
def code(tmp_path):
    """Rooms of a few lines, and leases that are soon out."""
    code = tiny_batch.build(tmp_path / "code")
    lease = code / "core" / "capture" / "lease.py"
    text = lease.read_text(encoding="utf-8")
    assert "TERM_S = 30.0\n" in text
    lease.write_text(text.replace("TERM_S = 30.0\n", "TERM_S = 3.0\n"), encoding="utf-8")
    tiny_chain.compile_once(code)
    return code


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """The address of a head node that works on nothing and two others with a core each, all on this machine, which give
    a silent one up within seconds."""
    for name, value in (
        ("RAY_AUTH_MODE", "token"),
        ("RAY_AUTH_TOKEN", "ab" * 32),
        ("RAY_USAGE_STATS_ENABLED", "0"),
        ("RAY_worker_niceness", "0"),
        ("RAY_health_check_initial_delay_ms", "1000"),
        ("RAY_health_check_period_ms", "500"),
        ("RAY_health_check_timeout_ms", "1000"),
        ("RAY_health_check_failure_threshold", "4"),
    ):
        monkeypatch.setenv(name, value)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    address, nodes = f"127.0.0.1:{port}", []
    try:
        for number, words in enumerate(
            (
                ["--head", f"--port={port}", "--num-cpus=0", "--include-dashboard=false"],
                *[[f"--address={address}", "--num-cpus=1", f"--memory={6 << 30}"]] * 2,
            )
        ):
            log = tmp_path / f"{number}.log"
            with open(log, "wb") as file:
                nodes.append(
                    subprocess.Popen(
                        [
                            str(Path(sys.executable).with_name("ray")),
                            "start",
                            "--node-ip-address=127.0.0.1",
                            "--block",
                            f"--object-store-memory={80 << 20}",
                            *words,
                        ],
                        stdout=file,
                        stderr=file,
                        stdin=subprocess.DEVNULL,
                    )
                )
            deadline = time.monotonic() + WAIT_S
            while b"Ray runtime started" not in log.read_bytes():
                assert nodes[-1].poll() is None and time.monotonic() < deadline, log.read_text()
                time.sleep(0.1)
        yield address
    finally:
        for process in [number for node in nodes for number in offspring(node.pid)]:
            with contextlib.suppress(OSError):
                os.kill(process, signal.SIGKILL)
        for node in nodes:
            node.wait()


def offspring(process: int) -> list[int]:
    """A process and all that came of it, the eldest first."""
    found = [process]
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{process}/task").iterdir():
            found += [each for child in (thread / "children").read_text().split() for each in offspring(int(child))]
    return found


def parent(process: int) -> int:
    return int(Path(f"/proc/{process}/stat").read_bytes().rpartition(b") ")[2].split()[1])


def test_a_node_that_falls_silent_is_left(code, cluster, tmp_path):
    batch = make(code, tmp_path, "a", {"a": {"scan": "deaf"}})
    capture, account = batch.faces[0].capture, batch.root / ray_task.LOGS / f"{socket.gethostname()}.jsonl"
    with tiny_batch.start(
        code, "batch", "run", batch.root, "--on", "ray", "--address", cluster, "--cores", 1
    ) as process:
        deadline = time.monotonic() + WAIT_S
        while not list(capture.root.glob(".scan*")):
            assert process.poll() is None and time.monotonic() < deadline, process.communicate()
            time.sleep(0.05)
        tiny_batch.set_mood(capture, {})
        time.sleep(3)  # the batch has heard where its face is
        worker = json.loads(account.read_text(encoding="utf-8").splitlines()[0])["pid"]
        for silent in offspring(parent(worker)):
            os.kill(silent, signal.SIGSTOP)
        out, err = process.communicate(timeout=WAIT_S)
    assert process.returncode == 0 and err == "" and states(batch) == {"a": DONE}, out + err
    lines = [json.loads(line) for line in account.read_text(encoding="utf-8").splitlines()]
    begun = [(line["stage"], line["pid"] == worker) for line in lines if not line["finished"]]
    assert begun[:3] == [("frames", True), ("cameras", True), ("scan", True)], "what was finished is not begun again"
    assert [stage for stage, _ in begun[3:]] == [
        "scan",
        "registration",
        "delight",
        "texture",
        "shadow_mask",
        "solve",
        "upscale",
        "transfer",
    ]
    assert not any(silent for _, silent in begun[3:])
    assert core(code, "batch", "status", batch.root).stdout.splitlines()[0].split() == ["a", "done"]
