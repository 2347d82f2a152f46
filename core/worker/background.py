# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that needs no worker and must not block Blender: one function in a thread, polled like a Worker.

Standard library only.
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import threading
import time
from collections.abc import Callable

from ..capture import switchlight_api, unforeseen
from ..capture.messages import FINAL, Cancelled, CancelledError, Done, Failed, Message, Problem, Progress

PLACES = frozenset({"PIP_USER", "PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_CONSTRAINT"})
"""pip's environment variables that would put packages elsewhere, or bring others than a lock says."""
GRACE_S = 1.0
"""Longest time that `poll` waits for the thread of a cancelled task."""


class BackgroundTask:
    """`work(task)` in a thread; it may call `task.say` and `task.run`. Its return value becomes `result`."""

    def __init__(self, name: str, work: Callable[[BackgroundTask], object]):
        self.name = name
        self.result: object = None
        self.running = False
        self._work = work
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._cancelled_at: float | None = None
        self._process: subprocess.Popen | None = None
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        self.running = True
        self._thread = threading.Thread(target=self._main, name=f"wildcap-{self.name}", daemon=True)
        self._thread.start()

    def poll(self) -> list[Message]:
        """Return the messages since the last call; the last of all is Done, Cancelled or Failed."""
        if self.running and self._cancelled_at is not None:
            self.running = self._thread.is_alive() and time.monotonic() - self._cancelled_at < GRACE_S
            return [] if self.running else [Cancelled(self.name)]
        messages = []
        while self.running and not self._messages.empty():
            messages.append(self._messages.get())
            self.running = not isinstance(messages[-1], FINAL)
        return messages

    def cancel(self) -> None:
        self._cancelled_at = self._cancelled_at or time.monotonic()
        self._kill()

    terminate = cancel

    @property
    def cancelled(self) -> bool:
        return self._cancelled_at is not None

    def check(self) -> None:
        """Raise CancelledError if the task was cancelled: other work may begin in the same place after GRACE_S."""
        if self.cancelled:
            raise CancelledError(self.name)

    def say(self, done: float, of: float, text: str) -> None:
        """Report progress. Raises CancelledError."""
        self.check()
        self._messages.put(Progress(self.name, done, of, text))

    def run(
        self, command: list, hear: Callable[[str], None] = lambda line: None, limit_s: float = threading.TIMEOUT_MAX
    ) -> tuple[int, str]:
        """Run a command, kill it after `limit_s`, and return its exit code and the last line that contains "error".

        `hear` takes each line of its output. Raises OSError if it cannot be started, and CancelledError.
        """
        self.check()
        apart = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {"start_new_session": True}
        environment = {
            name: value
            for name, value in switchlight_api.environment_without_key().items()
            if not name.startswith("PYTHON") and name not in PLACES
        }
        self._process = subprocess.Popen(
            [str(word) for word in command],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            **apart,
        )
        if self._cancelled_at is not None:
            self._kill()
        last_error, limit = "", threading.Timer(limit_s, self._kill)
        limit.daemon = True
        limit.start()
        try:
            with self._process.stdout as lines:
                for line in lines:
                    hear(line)
                    last_error = line.strip() if "error" in line.lower() else last_error
            code = self._process.wait()
        finally:
            limit.cancel()
        self.check()
        return code, last_error

    def _kill(self) -> None:
        """End the running command and, except on Windows, its children (venv runs pip's installer)."""
        if self._process is None or self._process.poll() is not None:
            return
        with contextlib.suppress(OSError):  # it has just ended by itself
            if os.name == "nt":
                self._process.kill()
            else:
                os.killpg(self._process.pid, signal.SIGKILL)

    def _main(self) -> None:
        started = time.monotonic()
        try:
            self.result = self._work(self)
            final = Done(round(time.monotonic() - started, 1))
        except CancelledError:
            final = Cancelled(self.name)
        except Problem as problem:
            final = Failed(self.name, problem.problem, problem.remedy)
        except Exception as error:
            problem = unforeseen.explain(error, self.name)
            final = Failed(self.name, problem.problem, problem.remedy)
        self._messages.put(final)
