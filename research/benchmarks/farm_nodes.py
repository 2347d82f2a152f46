# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Three machines on one: nodes of Ray in namespaces of their own, with a hostname, a network and process numbers that
nobody else has, on the same disk.

The network is a bridge in the head node's namespace with a cable (veth) to each of the others; nothing of it reaches
this machine's own network. A machine is pulled from it as by hand: its cable first, then all of its processes at once.
Linux, as root, with iproute2 and util-linux.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from core.capture.messages import Problem
from core.worker.client import THREAD_VARIABLES

PREFIX = "wildcap_"
HEAD, WORKING = "head", ("a", "b")
PORT = 6379
ADDRESSES = {HEAD: "10.77.0.1", "a": "10.77.0.2", "b": "10.77.0.3"}
MEMORY = 12 << 30
"""What a node says that it has: enough for the largest task. It is a number to Ray; nobody is held to it."""
STORE = 80 << 20
ACCOUNT = Path("/sys/fs/cgroup/cpuacct")
"""Where the kernel counts the processor's time of a group of processes, where it does that as Linux did first."""
START_S = 120
STARTED = b"Ray runtime started"
"""What `ray start` says when the node is one of the cluster."""


def refuse_elsewhere() -> None:
    """Raises Problem where no such machines can be made."""
    if not sys.platform.startswith("linux") or os.getuid() != 0:
        raise Problem(
            "The nodes of this benchmark are namespaces, which take Linux and root.",
            "Run it as root on Linux, as in a container with all rights.",
        )
    for program, package in (
        ("ip", "iproute2"),
        ("unshare", "util-linux"),
        ("nsenter", "util-linux"),
        ("mount", "mount"),
        ("taskset", "util-linux"),
    ):
        if shutil.which(program) is None:
            raise Problem(f"There is no program {program} here.", f"Install it: apt-get install {package}.")


@dataclass
class Node:
    """`core` is the processor that it has, None: any. `space` names its process numbers once it runs."""

    name: str
    folder: Path
    core: int | None = None
    process: subprocess.Popen | None = None
    space: str = ""
    environment: dict = field(default_factory=dict)

    @property
    def host(self) -> str:
        return f"farm-{self.name}"

    def start(self) -> None:
        """Raises Problem where it does not begin."""
        common = [
            str(Path(sys.executable).with_name("ray")),
            "start",
            f"--node-ip-address={ADDRESSES[self.name]}",
            "--block",
            "--disable-usage-stats",
            f"--object-store-memory={STORE}",
        ]
        own = (
            ["--head", f"--port={PORT}", "--num-cpus=0", "--include-dashboard=false"]
            if self.name == HEAD
            else [f"--address={ADDRESSES[HEAD]}:{PORT}", "--num-cpus=1", f"--memory={MEMORY}"]
        )
        script = f"hostname {self.host} && mkdir -p /tmp/ray && mount -t tmpfs tmpfs /tmp/ray && exec \"$@\""
        command = [
            "ip",
            "netns",
            "exec",
            PREFIX + self.name,
            "unshare",
            "--uts",
            "--pid",
            "--mount",
            "--fork",
            "--kill-child",
            "--mount-proc",
            "sh",
            "-c",
            script,
            "sh",
            *on_core(self.core),
            *common,
            *own,
        ]
        path = self.folder / f"{self.name}.log"
        with open(path, "wb") as log:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self.environment, preexec_fn=join_account
            )
        deadline = time.monotonic() + START_S
        while STARTED not in path.read_bytes():
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise Problem(f"The node {self.name} did not begin.", f"Read {path}.")
            time.sleep(0.1)
        self.space = os.readlink(f"/proc/{self._first()}/ns/pid")

    def _first(self) -> int:
        """The number here of the process that is the node's number 1; 0 while there is none."""
        with contextlib.suppress(OSError, ValueError, IndexError):
            child = int(Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()[0])
            if os.readlink(f"/proc/{child}/ns/pid") != os.readlink("/proc/self/ns/pid"):
                return child
        return 0

    def enter(self, folder: Path) -> list[str]:
        """Words before a command that has it run on this node, in a folder."""
        return [
            "nsenter",
            f"--target={self._first()}",
            "--mount",
            "--uts",
            "--net",
            "--pid",
            f"--wd={folder}",
            *on_core(self.core),
        ]

    def tasks(self) -> list[tuple[int, int, str]]:
        """The processes of Ray's that work on a task: number here, number on the node, and the task's name."""
        found = []
        for folder in Path("/proc").iterdir():
            with contextlib.suppress(OSError, ValueError, IndexError):
                words = (folder / "cmdline").read_bytes().partition(b"\0")[0].decode()
                if words.startswith("ray::") and "." in words and os.readlink(folder / "ns" / "pid") == self.space:
                    inside = next(
                        line for line in (folder / "status").read_text().splitlines() if line.startswith("NSpid:")
                    ).split()[-1]
                    found.append((int(folder.name), int(inside), words.removeprefix("ray::")))
        return found

    def kill(self) -> None:
        """The power fails: nobody hears from it again."""
        _ip("-n", PREFIX + self.name, "link", "set", "eth0", "down")
        self.stop()

    def come_back(self) -> None:
        _ip("-n", PREFIX + self.name, "link", "set", "eth0", "up")
        self.start()

    def stop(self) -> None:
        if self.process is not None:
            with contextlib.suppress(OSError):
                # with the first process of a space all others end
                os.kill(self._first() or self.process.pid, signal.SIGKILL)
            self.process.kill()
            self.process.wait()
            self.process = None


@contextlib.contextmanager
def farm(folder: Path):
    """The head node and two others, by name, running; whatever an earlier run left of them is ended first. Raises
    Problem."""
    folder.mkdir(parents=True, exist_ok=True)
    clear()
    token = folder / "token"
    if not token.is_file():
        token.write_text(secrets.token_hex(32))
        token.chmod(0o600)
    environment = {
        **os.environ,
        "RAY_AUTH_MODE": "token",
        "RAY_AUTH_TOKEN_PATH": str(token),
        "RAY_USAGE_STATS_ENABLED": "0",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    environment = {name: value for name, value in environment.items() if name not in (*THREAD_VARIABLES, "RAY_ADDRESS")}
    nodes = {
        name: Node(name, folder, core, environment=environment)
        for name, core in zip((HEAD, *WORKING), (None, *cores()), strict=True)
    }
    try:
        _lay_cables()
        for node in nodes.values():
            node.start()
        yield nodes
    finally:
        for node in nodes.values():
            node.stop()
        clear()


def cores() -> tuple[int, int]:
    """The processor of each node: two, or twice the same."""
    usable = sorted(os.sched_getaffinity(0))
    return usable[0], usable[-1]


def on_core(core: int | None) -> list[str]:
    return [] if core is None else ["taskset", "--cpu-list", str(core)]


def _lay_cables() -> None:
    for name in ADDRESSES:
        _ip("netns", "add", PREFIX + name)
        _ip("-n", PREFIX + name, "link", "set", "lo", "up")
    head = PREFIX + HEAD
    _ip("-n", head, "link", "add", "eth0", "type", "bridge")
    for name in WORKING:
        _ip("link", "add", f"to_{name}", "netns", head, "type", "veth", "peer", "name", "eth0", "netns", PREFIX + name)
        _ip("-n", head, "link", "set", f"to_{name}", "master", "eth0", "up")
    for name, address in ADDRESSES.items():
        _ip("-n", PREFIX + name, "address", "add", f"{address}/24", "dev", "eth0")
        _ip("-n", PREFIX + name, "link", "set", "eth0", "up")


def clear() -> None:
    """Ends the processes of these namespaces, and the namespaces."""
    for name in ADDRESSES:
        found = subprocess.run(["ip", "netns", "pids", PREFIX + name], capture_output=True, text=True)
        for number in found.stdout.split():
            with contextlib.suppress(OSError):
                os.kill(int(number), signal.SIGKILL)
        if found.returncode == 0:
            subprocess.run(["ip", "netns", "delete", PREFIX + name], capture_output=True)


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True)
    if done.returncode:
        raise Problem(
            f"`ip {' '.join(words)}` says: {done.stderr.strip()}",
            "Run the benchmark where namespaces may be made, as in a container with all rights.",
        )


def keep_pace() -> None:
    """Has all that is counted compete as any other process: a worker steps back for whoever sits at its machine, and at
    these nobody does. On a machine that others use they would stand still for minutes."""
    with contextlib.suppress(OSError):
        for number in (ACCOUNT / PREFIX.rstrip("_") / "cgroup.procs").read_text().split():
            with contextlib.suppress(OSError):
                Path(f"/proc/{number}/autogroup").write_text("0")
            with contextlib.suppress(OSError):
                for thread in os.listdir(f"/proc/{number}/task"):
                    os.setpriority(os.PRIO_PROCESS, int(thread), 0)


def join_account() -> None:
    """Has this process, and all that it starts, counted together; nothing where the kernel does not count so."""
    with contextlib.suppress(OSError):
        group = ACCOUNT / PREFIX.rstrip("_")
        group.mkdir(exist_ok=True)
        (group / "cgroup.procs").write_text(str(os.getpid()))


def counted_s() -> float | None:
    """Seconds of the processor that were counted so far, of all that have joined, those that were killed among them;
    None where nothing is counted."""
    try:
        return int((ACCOUNT / PREFIX.rstrip("_") / "cpuacct.usage").read_text()) / 1e9
    except (OSError, ValueError):
        return None
