# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that needs no worker's Python and must not hold Blender up: one function in a thread, polled like a Worker.

Ground floor: standard library only.
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
"""Environment variables of pip's that would have packages elsewhere than in the environment they are for, or others
than a lock says."""
GRACE_S = 1.0
"""How long a cancelled task's thread may take to end before it is waited for no longer."""


class BackgroundTask:
    """`work(task)` in a thread. It may call `task.say` and `task.run`; what it returns is `result`, and a Problem it
    raises ends it as Failed."""

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
        """The messages since the last call; the last of all is Done, Cancelled or Failed. After a cancel the thread is
        waited for a second at most."""
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
        """Raises CancelledError where the task was cancelled: whoever did so takes the work for ended within GRACE_S,
        and may begin another in the same place."""
        if self.cancelled:
            raise CancelledError(self.name)

    def say(self, done: float, of: float, text: str) -> None:
        """Raises CancelledError as `check`."""
        self.check()
        self._messages.put(Progress(self.name, done, of, text))

    def run(
        self, command: list, hear: Callable[[str], None] = lambda line: None, limit_s: float = threading.TIMEOUT_MAX
    ) -> tuple[int, str]:
        """Runs a command, for `limit_s` at most, each line it writes through `hear`; its exit code and the last line
        with an error in it. Raises OSError when it cannot be started, and CancelledError where the task is cancelled
        before or meanwhile."""
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
        """Ends the running command and, where the system can, what that has started (venv runs pip's own installer)."""
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
        except Exception as error:  # a thread has nobody above it: an artist reads problems, not tracebacks
            problem = unforeseen.explain(error, self.name)
            final = Failed(self.name, problem.problem, problem.remedy)
        self._messages.put(final)
