# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that needs no worker's Python and must not hold Blender up: one function in a thread, polled like a Worker.

Ground floor: standard library only.
"""

from __future__ import annotations

import os
import queue
import subprocess
import threading
import time
from collections.abc import Callable

from ..messages import FINAL, Cancelled, Done, Failed, Message, Problem, Progress


class Task:
    """`work(task)` in a thread. It may call `task.say` and `task.run`; what it returns is `result`, and a Problem it raises ends it as Failed."""

    def __init__(self, name: str, work: Callable[[Task], object]):
        self.name = name
        self.result: object = None
        self.running = False
        self._work = work
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._cancelled = threading.Event()
        self._process: subprocess.Popen | None = None

    def start(self) -> None:
        self.running = True
        threading.Thread(target=self._main, name=f"wildcap-{self.name}", daemon=True).start()

    def poll(self) -> list[Message]:
        """The messages since the last call; the last of all is Done, Cancelled or Failed. After a cancel the thread is waited for no longer."""
        if self.running and self._cancelled.is_set():
            self.running = False
            return [Cancelled(self.name)]
        found = []
        while self.running and not self._messages.empty():
            found.append(self._messages.get())
            self.running = not isinstance(found[-1], FINAL)
        return found

    def cancel(self) -> None:
        self._cancelled.set()
        if self._process is not None and self._process.poll() is None:
            self._process.kill()

    terminate = cancel

    def say(self, done: float, of: float, text: str) -> None:
        self._messages.put(Progress(self.name, done, of, text))

    def run(self, command: list) -> tuple[int, str]:
        """Runs a command; its exit code and the last line it wrote with an error in it. Raises OSError when it cannot be started."""
        flags = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        self._process = subprocess.Popen([str(word) for word in command], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                         stderr=subprocess.STDOUT, text=True, encoding="utf-8", errors="replace", **flags)
        if self._cancelled.is_set():
            self._process.kill()
        lines = self._process.communicate()[0].splitlines()
        return self._process.returncode, next((line.strip() for line in reversed(lines) if "error" in line.lower()), "")

    def _main(self) -> None:
        started = time.monotonic()
        try:
            self.result = self._work(self)
            final = Done(round(time.monotonic() - started, 1))
        except Problem as problem:
            final = Failed(self.name, problem.problem, problem.remedy)
        except Exception as error:  # a thread has nobody above it: an artist reads problems, not tracebacks
            final = Failed(self.name, f"Something failed unexpectedly: {type(error).__name__}: {error}", "Try again; if it stays, report it with this text.")
        self._messages.put(final)
