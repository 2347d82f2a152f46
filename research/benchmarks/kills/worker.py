# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes forked from this one, which has imported torch and the rest already, and the signals that strike them.

A forked worker is `core.worker.__main__.main`, as `python -m core.worker JOB.json` runs it. An audit hook (PEP 578) in
the process counts what it writes; the product has no part in it.
"""

import importlib
import mmap
import multiprocessing
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from core.capture import lease, stages
from core.capture.code_key import code_key
from core.capture.messages import FINAL, Message, from_line

LIMIT_S = 300.0
"""Time after which a process counts as hanging."""
POLL_S = 0.0005
CHANGES = {"os.rename": 2, "os.remove": 1, "os.mkdir": 1, "os.rmdir": 1, "os.chmod": 1, "os.truncate": 1}
"""Audit events that change a file or folder, and how many of their first arguments are paths; `open` goes by flags."""


@dataclass(frozen=True)
class Moment:
    """When a process is struck: `after_s` from its start, or `late_s` after its `write`-th change of a file (from 1).

    Without `late_s` the process waits before that change until it is struck.
    """

    after_s: float | None = None
    write: int | None = None
    late_s: float = 0.0

    def __str__(self) -> str:
        late = f" and {1000 * self.late_s:.1f} ms" if self.late_s else ""
        return f"after {self.after_s:.3f} s" if self.write is None else f"before change {self.write}{late}"


def warm_up() -> None:
    """Import all that a worker imports, and read what every worker reads of the code, without starting a thread."""
    for step in (*stages.STAGES, *stages.TOOLS):
        importlib.import_module(step.module)
    for stage in stages.STAGES:
        code_key(stage.module)
    importlib.import_module("core.face.template").load()
    importlib.import_module("core.worker.__main__")
    importlib.import_module("torch").set_num_threads(1)
    importlib.import_module("cv2").setNumThreads(1)


class Forked:
    """A forked process in a group of its own that does `work`, which may return an exit code.

    Standard output goes to `log`, errors to the file of the same name that ends with .err. `root` is the folder in
    which changes are counted. After the end `code` is negative for a signal, and `peak` the memory in bytes.
    """

    def __init__(self, work: Callable[[], int | None], root: Path, log: Path, moment: Moment | None = None):
        self.moment, self.log, self.code, self.peak = moment, log, None, 0
        self._shared = memoryview(mmap.mmap(-1, 16)).cast("q")  # changes so far; 1 once a waiting process may go on
        stdin, self._stdin = os.pipe()
        log.unlink(missing_ok=True)
        sys.stdout.flush()
        self.began = time.monotonic()
        self.pid = os.fork()
        if self.pid == 0:
            os.close(self._stdin)
            self._run(work, f"{root}/", stdin)
        os.setpgid(self.pid, self.pid)  # parent and child both do it: the group exists from here on
        os.close(stdin)

    @property
    def changes(self) -> int:
        return self._shared[0]

    @property
    def errors(self) -> str:
        return self.log.with_suffix(".err").read_text(encoding="utf-8", errors="replace")

    def strike(self, number: int = signal.SIGKILL) -> bool:
        """Send a signal to the group at the moment, and wait for the end of what was killed.

        Return False if the process ended before.
        """
        reached = None
        while not self.ended():
            now = time.monotonic()
            if self.moment.write is None:
                due = now - self.began >= self.moment.after_s
            else:
                reached = reached or (now if self.changes >= self.moment.write else None)
                due = reached is not None and now - reached >= self.moment.late_s
            if due:
                self.send(number)
                self._shared[1] = 1
                return number != signal.SIGKILL or self.wait() is None
            time.sleep(POLL_S)
        return False

    def send(self, number: int) -> None:
        """Send a signal to the whole group."""
        os.killpg(self.pid, number)

    def wait(self, limit_s: float = LIMIT_S) -> Message | None:
        """Return the worker's final message, None if it gave none. Kill it and raise TimeoutError if it hangs."""
        hangs = False
        while not self.ended():
            if not hangs and time.monotonic() - self.began > limit_s:
                hangs = True
                self.send(signal.SIGKILL)
            time.sleep(POLL_S)
        if hangs:
            raise TimeoutError(f"process {self.pid} did not end within {limit_s:.0f} s")
        return last_message(self.log)

    def ended(self) -> bool:
        """Return True once the process itself has ended; what it started may go on."""
        if self.code is None:
            pid, status, used = os.wait4(self.pid, os.WNOHANG)
            if pid:
                self.code, self.peak = os.waitstatus_to_exitcode(status), 1024 * used.ru_maxrss
                os.close(self._stdin)
        return self.code is not None

    def _run(self, work: Callable[[], int | None], root: str, stdin: int) -> NoReturn:
        code = 1
        try:
            os.setpgid(0, 0)
            os.dup2(stdin, 0)  # its end tells that the parent is gone
            for number, path in ((1, self.log), (2, self.log.with_suffix(".err"))):
                os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC | os.O_APPEND, 0o666), number)
            sys.stdin = open(0, encoding="utf-8", closefd=False)
            sys.addaudithook(lambda event, arguments: self._count(event, arguments, root))
            code = work() or 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def _count(self, event: str, arguments: tuple, root: str) -> None:
        if not _changes(event, arguments, root):
            return
        self._shared[0] += 1
        if self.moment and self.moment.write and not self.moment.late_s:
            while self._shared[0] >= self.moment.write and not self._shared[1]:
                time.sleep(POLL_S)


def fork_worker(
    job: Path, log: Path, moment: Moment | None = None, *, term_s: float = lease.TERM_S, most_bytes: int | None = None
) -> Forked:
    """Fork a worker for a job file; `most_bytes` limits each file that it writes, `term_s` is the term of its lease."""

    def work() -> None:
        main = importlib.import_module("core.worker.__main__")
        main.NICE_VALUE = 0  # nobody paints beside it
        lease.TERM_S = term_s
        sys.argv = ["core.worker", str(job)]
        if most_bytes is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, resource.RLIM_INFINITY))
        main.main()

    return Forked(work, job.parent.parent, log, moment)


def last_message(log: Path) -> Message | None:
    """Return the final message in a worker's output; None if there is none, as of a worker that was killed."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    try:
        message = from_line(lines[-1]) if lines else None
    except ValueError:  # cut off
        return None
    return message if isinstance(message, FINAL) else None


def in_fork(work: Callable[[], object]):
    """Return what `work` returns in a process of its own, so that this one starts no thread."""
    context = multiprocessing.get_context("fork")
    answer, end = context.Pipe(duplex=False)
    child = context.Process(target=lambda: end.send(work()))
    child.start()
    child.join()
    if child.exitcode != 0:
        raise RuntimeError("the work failed in its own process")
    return answer.recv()


def running_at(place: Path) -> list[int]:
    """Return the other processes that have a path below `place` in their command line, as COLMAP has."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if str(place).encode() in entry.read_bytes() and int(entry.parent.name) != os.getpid():
                found.append(int(entry.parent.name))
        except OSError:  # it has just ended
            continue
    return found


def _changes(event: str, arguments: tuple, root: str) -> bool:
    """Return True for an audit event that changes something below `root`, or opens what is being written there."""
    if event == "open":
        path, _, flags = arguments
        name = os.fsdecode(path) if isinstance(path, str | bytes) else ""
        return name.startswith(root) and (bool(flags & (os.O_WRONLY | os.O_RDWR)) or ".tmp" in name)
    paths = [
        os.fsdecode(path) for path in arguments[: CHANGES.get(event, 0)] if isinstance(path, str | bytes | os.PathLike)
    ]
    # shutil.rmtree names what it removes relative to an open folder
    return any(path.startswith(root) or not os.path.isabs(path) for path in paths)
