# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors that nobody foresaw: the traceback goes to a log under an id, the user reads what stopped, what is kept and
what to do. Standard library only.

The id is that of the place in the code: the same fault has the same id on every machine.
"""

from __future__ import annotations

import contextlib
import hashlib
import time
import traceback
from collections import deque
from pathlib import Path

from .messages import Problem

recent: deque[str] = deque(maxlen=10)
"""The last such errors of this process, as they went to the log."""
LOG = "unforeseen.log"
"""In a capture's folder of logs, for those that no stage was stopped by."""
KEPT = (
    "What was finished is kept. Try again; if it happens again, Save Report (in a terminal: core report-problem) "
    "writes a file about it that you can send us."
)


def explain(error: BaseException, stopped: str, log: Path | None = None) -> Problem:
    """The Problem of an error that stopped something ("the stage solve"), whose traceback is added to `log` where there
    is one."""
    name = identify(error)
    text = (
        f"{time.strftime('%Y-%m-%d %H:%M:%S')} {name} stopped {stopped}\n{''.join(traceback.format_exception(error))}"
    )
    recent.append(text)
    if log is not None:
        with contextlib.suppress(OSError):  # the disk may be full; that is said elsewhere
            log.parent.mkdir(parents=True, exist_ok=True)
            with open(log, "a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
    return Problem(
        f"An error inside WildCap stopped {stopped} ({name}, {type(error).__name__}: {_first_line(error)}).",
        KEPT + (f" The log is {log}." if log is not None else ""),
    )


def identify(error: BaseException) -> str:
    """As WC-3f9a1c: the kind of an error and the functions it came through, without line numbers and folders."""
    way = [(Path(frame.filename).name, frame.name) for frame in traceback.extract_tb(error.__traceback__)]
    return f"WC-{hashlib.blake2b(repr((type(error).__name__, way[-6:])).encode(), digest_size=3).hexdigest()}"


def _first_line(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else "no message"
