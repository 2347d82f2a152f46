# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes that are forked from this one, in which torch and the rest are imported already, and struck by a signal at
a chosen moment.

A worker that is forked is `core.worker.__main__.main`, as `python -m core.worker JOB.json` runs it. What a process
writes is counted by an audit hook (PEP 578) in that process alone: the product has no part in it.
"""

from __future__ import annotations

import importlib
import json
import mmap
import os
import resource
import signal
import struct
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from core.capture import lease, stages
from core.capture.code_key import code_key
from core.capture.messages import FINAL, Message, from_line

LIMIT_S = 300.0
"""After which a process counts as hanging."""
LOOK_S = 0.0005
CHANGES = {"os.rename": 2, "os.remove": 1, "os.mkdir": 1, "os.rmdir": 1, "os.chmod": 1, "os.truncate": 1}
"""Audit events that change a folder or a file -> how many of their first arguments are paths; `open` is judged by its
flags."""


@dataclass(frozen=True)
class Moment:
    """When a process is struck: `after_s` from its start, or before its `write`-th change of a file in its place (from
    1) and `late_s` after that."""

    after_s: float | None = None
    write: int | None = None
    late_s: float = 0.0

    def __str__(self) -> str:
        late = f" and {1000 * self.late_s:.1f} ms" if self.late_s else ""
        return f"after {self.after_s:.3f} s" if self.write is None else f"before change {self.write}{late}"


def warm_up() -> None:
    """Import all that a worker comes to import, reads what every worker reads of the code, and starts no thread."""
    for step in (*stages.STAGES, *stages.TOOLS):
        importlib.import_module(step.module)
    for stage in stages.STAGES:
        code_key(stage.module)
    importlib.import_module("core.face.template").load()
    importlib.import_module("core.worker.__main__")
    importlib.import_module("torch").set_num_threads(1)
    importlib.import_module("cv2").setNumThreads(1)


class Forked:
    """A forked process that does `work`, in a group of its own, and what strikes it. Its output goes to `told`, its
    errors beside that."""

    def __init__(self, work: Callable[[], None], root: Path, log: Path, moment: Moment | None = None):
        self.moment, self.told, self.code = moment, log, None
        self._shared = mmap.mmap(-1, 16)  # changes so far, and whether a process that waits to be struck may go on
        self._stdin, end = os.pipe()[::-1]
        log.unlink(missing_ok=True)
        sys.stdout.flush()
        self.began = time.monotonic()
        self.pid = os.fork()
        if self.pid == 0:
            code = 70
            try:
                os.close(self._stdin)
                os.setpgid(0, 0)
                _redirect(end, log)
                sys.addaudithook(self._hook(f"{root}/"))
                work()
                code = 0
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(code)
        os.setpgid(self.pid, self.pid)  # both do it: whoever is first, there is a group from here on
        os.close(end)

    @property
    def changes(self) -> int:
        return struct.unpack_from("q", self._shared, 0)[0]

    def strike(self, number: int = signal.SIGKILL) -> bool:
        """Wait for the moment and sends the signal to the group; waits for the end of what was killed. False where the
        process ended before."""
        reached = None
        while not self.ended():
            now = time.monotonic()
            if reached is None and self.moment.write is not None and self.changes >= self.moment.write:
                reached = now
            if (
                now - self.began >= self.moment.after_s
                if self.moment.write is None
                else reached is not None and now - reached >= self.moment.late_s
            ):
                self.send(number)
                struct.pack_into("q", self._shared, 8, 1)
                return number != signal.SIGKILL or self.wait() is None
            time.sleep(LOOK_S)
        return False

    def send(self, number: int) -> None:
        """To the whole group."""
        os.killpg(self.pid, number)

    def wait(self) -> Message | None:
        """The worker's final message; None where it has said none. Raises TimeoutError where it hangs, and ends it."""
        while not self.ended():
            if time.monotonic() - self.began > LIMIT_S:
                self.send(signal.SIGKILL)
                os.waitpid(self.pid, 0)
                raise TimeoutError(f"process {self.pid} did not end within {LIMIT_S:.0f} s")
            time.sleep(LOOK_S)
        return last_message(self.told)

    def ended(self) -> bool:
        """Return whether the process itself has; what it started may go on."""
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.code = os.waitstatus_to_exitcode(status)
                os.close(self._stdin)
        return self.code is not None

    def _hook(self, root: str) -> Callable[[str, tuple], None]:
        shared, stop = self._shared, self.moment and self.moment.write
        wait = bool(stop) and not self.moment.late_s

        def hook(event: str, arguments: tuple) -> None:
            if not _changes(event, arguments, root):
                return
            count = struct.unpack_from("q", shared, 0)[0] + 1
            struct.pack_into("q", shared, 0, count)
            while wait and count >= stop and not shared[8]:
                time.sleep(LOOK_S)

        return hook


def fork_worker(
    job: Path, log: Path, moment: Moment | None = None, *, term_s: float = lease.TERM_S, most_bytes: int | None = None
) -> Forked:
    """Fork a worker at a job file.

    moment: when it is struck; None: never; most_bytes: of a single file that it writes; None: any."""

    def work() -> None:
        main = importlib.import_module("core.worker.__main__")
        main.NICE_VALUE = 0  # beside it nobody paints
        lease.TERM_S = term_s
        sys.argv = ["core.worker", str(job)]
        if most_bytes is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, resource.RLIM_INFINITY))
        main.main()

    return Forked(work, job.parent.parent, log, moment)


def last_message(log: Path) -> Message | None:
    """The final message among the lines that a worker wrote; None where there is none, as of one that was killed."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    try:
        message = from_line(lines[-1]) if lines else None
    except ValueError:  # cut off
        return None
    return message if isinstance(message, FINAL) else None


def in_fork(work: Callable[[], object]):
    """What `work` returns, as JSON holds it, computed in a process of its own: this one starts no threads. Raises
    RuntimeError where it raised."""
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            os.close(read)
            with os.fdopen(write, "w") as file:
                json.dump(work(), file)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(write)
    with os.fdopen(read) as file:
        text = file.read()
    if os.waitpid(pid, 0)[1] != 0:
        raise RuntimeError("what was to be done in a process of its own failed there")
    return json.loads(text)


def running_at(place: Path) -> list[int]:
    """Processes that have a path below `place` in their command line, as COLMAP's has, this one apart."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if str(place).encode() in entry.read_bytes() and int(entry.parent.name) != os.getpid():
                found.append(int(entry.parent.name))
        except OSError:  # it has just ended
            continue
    return found


def _changes(event: str, arguments: tuple, root: str) -> bool:
    """Return whether an audit event changes something in the folder `root`, or opens what is just being written
    there."""
    if event == "open":
        path, _, flags = arguments
        name = os.fsdecode(path) if isinstance(path, str | bytes) else ""
        return name.startswith(root) and (bool(flags & (os.O_WRONLY | os.O_RDWR)) or ".tmp" in name)
    if event not in CHANGES:
        return False
    paths = [os.fsdecode(path) for path in arguments[: CHANGES[event]] if isinstance(path, str | bytes | os.PathLike)]
    # shutil.rmtree names what it removes by an open folder
    return any(path.startswith(root) or not os.path.isabs(path) for path in paths)


def _redirect(stdin: int, log: Path) -> None:
    """The descriptors 0 to 2: the pipe that ends with this process's parent, and files for what it says."""
    os.dup2(stdin, 0)
    for number, path in ((1, log), (2, log.with_suffix(".err"))):
        descriptor = os.open(path, os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o666)
        os.dup2(descriptor, number)
        os.close(descriptor)
    sys.stdin = open(0, encoding="utf-8", closefd=False)
