# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -E -s -B -m core.worker JOB.json: the worker's side of the protocol.

JSON lines leave by the real stdout, which is kept away from everybody else; everything printed goes to stderr, a log
file. stdin brings the line `cancel`; its end means that whoever started the worker is gone.
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
"""Nice value: beside a Blender that wants all of the processor, the worker gets a thirtieth of it."""


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
    """Lowers the priority, so that whatever the artist does in Blender comes first; an idle Blender costs the worker
    nothing.

    Linux desktops share the processor between sessions first (sched(7), "The autogroup feature"). A worker is a session
    of its own, so its nice value alone says nothing to Blender: that of its group does.
    """
    os.nice(NICE_VALUE)
    # only there on such a Linux
    with contextlib.suppress(OSError), open("/proc/self/autogroup", "w", encoding="ascii") as group:
        group.write(str(NICE_VALUE))


def _take_stdout():
    """A function that sends a message by the real stdout; afterwards descriptor 1 is stderr, also for C++."""
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
