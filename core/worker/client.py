# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker process as Blender and the command line see it, read without ever waiting.

A job file goes in; messages come out of `Worker.poll`, the last of them always Done, Cancelled or Failed. A reader
thread only fills a queue, so nothing calls the host from a thread. Standard library only.
"""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import threading
import time
from pathlib import Path

from ..capture import switchlight_api
from ..capture.files import storage_problem
from ..capture.messages import FINAL, Cancelled, Failed, Log, Message, Problem, from_line

GRACE_S = 0.7
"""Time for a cancelled worker to reach its next report before it is killed."""

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
SPINS = {"GOMP_SPINCOUNT": "2000"}
"""Rounds that a waiting thread of GCC's OpenMP (PyTorch's on Linux) spins before it sleeps. With the default of 300,000
it keeps the core from the very thread it waits for when another program, such as Blender, is busy."""


class Worker:
    """One job in its own process. `poll` it several times a second until it is no longer `running`."""

    def __init__(self, python: Path, root: Path, job: Path, log: Path, environment: dict[str, str] | None = None):
        """Prepare `python` to run a job file with the code in `root` (the folder that holds core/).

        stderr goes to `log`. `environment` lies over the caller's, for secrets that no file or command line may hold.
        """
        self.python = Path(python)
        self.root = Path(root)
        self.job = Path(job)
        self.log = Path(log)
        self._own = environment or {}
        self._messages: queue.SimpleQueue[Message | int] = queue.SimpleQueue()
        self._process: subprocess.Popen | None = None
        self._stage = ""
        self._cancelled_at: float | None = None
        self._ended = False
        self.died = False
        """True if the process ended without a final message, and nobody had cancelled it."""

    @property
    def running(self) -> bool:
        """True from `start` until `poll` has returned the final message."""
        return self._process is not None and not self._ended

    def start(self) -> None:
        """Start the process. Raises Problem if the log cannot be written or the Python cannot be started."""
        assert self._process is None, "a Worker runs one job"
        try:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            log = open(self.log, "wb")
        except OSError as error:
            raise storage_problem(error, self.log) from error
        package = __package__.split(".")[-2]  # core, whatever it is called inside Blender
        options = ("-E", "-s", "-B", "-X", "utf8", "-m", f"{package}.worker")
        command = [str(self.python), *options, str(self.job.absolute())]
        with log:
            try:
                self._process = subprocess.Popen(
                    command,
                    cwd=self.root,
                    env=_environment(self._own),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    **_apart(),
                )
            except OSError as error:
                raise Problem(
                    f"The solver's Python {self.python} could not be started ({error.strerror or error}).",
                    "Install the solver again, or choose another Python.",
                ) from error
        threading.Thread(target=self._read, name="wildcap-worker-reader", daemon=True).start()

    def poll(self) -> list[Message]:
        """Return the messages since the last call, without waiting. The last of all is a final one, exactly once."""
        if not self.running:
            return []
        if self._cancelled_at is not None and time.monotonic() - self._cancelled_at > GRACE_S:
            self._kill()
        messages: list[Message] = []
        while not self._ended:
            try:
                message = self._messages.get_nowait()
            except queue.Empty:
                break
            if isinstance(message, int):
                message = self._without_farewell(message)
            self._stage = getattr(message, "stage", self._stage)
            self._ended = isinstance(message, FINAL)
            messages.append(message)
        return messages

    def cancel(self) -> None:
        """Ask the worker to stop at its next report; `poll` kills it after the grace time."""
        if not self.running or self._cancelled_at is not None:
            return
        self._cancelled_at = time.monotonic()
        with contextlib.suppress(OSError):  # it has just ended by itself
            self._process.stdin.write(b"cancel\n")
            self._process.stdin.flush()

    def terminate(self) -> None:
        """Kill the process, for a host that is closing; `poll` then returns Cancelled."""
        if self.running:
            self._cancelled_at = self._cancelled_at or time.monotonic()
            self._kill()

    def _kill(self) -> None:
        # Not SIGTERM: a stopped process, or one inside a C++ call that blocks signals, would outlive it.
        if self._process.poll() is None:
            self._process.kill()

    def _read(self) -> None:
        """Queue the messages, then the exit code: the reader thread."""
        with self._process.stdout as lines:
            for line in lines:
                try:
                    self._messages.put(from_line(line.decode("utf-8", "replace")))
                except ValueError:
                    self._messages.put(Log(line.decode("utf-8", "replace").rstrip()))
        code = self._process.wait()
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._messages.put(code)

    def _without_farewell(self, code: int) -> Message:
        """Return the final message for a process that ended without one."""
        if self._cancelled_at is not None:
            return Cancelled(self._stage)
        self.died = True
        stage_log = self.log.parent / f"{self._stage}.log"
        log = stage_log if self._stage and stage_log.is_file() else self.log
        during = f" during the stage {self._stage}" if self._stage else " before its first stage"
        if code in (-9, 137):
            return Failed(
                self._stage,
                f"The worker was killed from outside{during}, most likely because memory ran out.",
                f"Close other programs or choose a lower quality, then run again: finished stages are kept. "
                f"The log is {log}.",
            )
        return Failed(
            self._stage,
            f"The worker ended unexpectedly{during} (exit code {code}).",
            f"Run again: finished stages are kept. If it happens again, read {log}.",
        )


def _environment(own: dict[str, str]) -> dict[str, str]:
    """Return the caller's environment below `own`, with the libraries' threads limited unless the user has done so.

    The key of a paid service is passed on only as part of `own`.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    threads = str(cores if cores <= 2 else cores - 1)
    return {**{name: threads for name in THREAD_VARIABLES}, **SPINS, **switchlight_api.environment_without_key(), **own}


def _apart() -> dict:
    """Return Popen arguments: out of reach of Ctrl-C, without a console window, below normal priority.

    On POSIX the worker lowers its own priority, because code between fork and exec is unsafe with threads.
    """
    if os.name != "nt":
        return {"start_new_session": True}
    flags = subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS | subprocess.CREATE_NEW_PROCESS_GROUP
    return {"creationflags": flags}
