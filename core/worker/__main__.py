# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -E -s -B -m core.worker JOB.json: the worker's side of the protocol.

Messages leave as JSON lines by the real stdout, which no library can reach; whatever is printed goes to stderr, a log
file. stdin brings the line `cancel`; its end means that the starter is gone.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import signal
import sys
import threading
from pathlib import Path

from ..capture import switchlight_api
from ..capture.messages import Message, to_line
from .runner import run_job

NICE_VALUE = 15
"""Gives the worker a thirtieth of the processor beside a busy Blender."""


def main() -> None:
    emit = _take_stdout()
    switchlight_api.keep_key()
    cancelled = threading.Event()
    threading.Thread(target=_listen, args=(cancelled,), name="control", daemon=True).start()
    if os.name == "posix":
        _step_back()
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the starter's to translate
    faulthandler.enable(2)
    emit(run_job(Path(sys.argv[1]), emit, cancelled.is_set))
    # Not sys.exit: tearing down torch and its threads takes seconds and can only go wrong.
    os._exit(0)


def _step_back() -> None:
    """Lower the priority, so that Blender comes first.

    Linux desktops share the processor between sessions first (sched(7), "The autogroup feature"), and a worker is a
    session of its own: its group's nice value counts.
    """
    os.nice(NICE_VALUE)
    with contextlib.suppress(OSError), open("/proc/self/autogroup", "w", encoding="ascii") as group:
        group.write(str(NICE_VALUE))


def _take_stdout():
    """Return a function that sends messages by the real stdout; make descriptor 1 stderr, also for C++."""
    channel = os.dup(1)
    os.dup2(2, 1)
    lock = threading.Lock()

    def emit(message: Message) -> None:
        line = (to_line(message) + "\n").encode("ascii")
        try:
            with lock:
                while line:
                    line = line[os.write(channel, line) :]
        except OSError:
            os._exit(3)  # nobody reads any more

    return emit


def _listen(cancelled: threading.Event) -> None:
    for line in sys.stdin:
        if line.strip() == "cancel":
            cancelled.set()
    os._exit(3)


if __name__ == "__main__":
    main()
