# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Unexpected errors: the traceback goes to a log under an id, the user gets a Problem.

The id follows from the place in the code, so the same fault has the same id on every machine.
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
"""Log entries of this process."""
LOG = "unforeseen.log"
"""In a capture's folder of logs, for errors outside of stages."""
KEPT = (
    "What was finished is kept. Try again; if it happens again, Save Report (in a terminal: core report-problem) "
    "writes a file about it that you can send us."
)


def explain(error: BaseException, stopped: str, log: Path | None = None) -> Problem:
    """Return the Problem of an error that stopped something ("the stage solve"), and add its traceback to `log`."""
    name = identify(error)
    text = (
        f"{time.strftime('%Y-%m-%d %H:%M:%S')} {name} stopped {stopped}\n{''.join(traceback.format_exception(error))}"
    )
    recent.append(text)
    if log is not None:
        with contextlib.suppress(OSError):  # a full disk is reported elsewhere
            log.parent.mkdir(parents=True, exist_ok=True)
            with open(log, "a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
    first_line = (str(error).strip().splitlines() or ["no message"])[0][:200]
    return Problem(
        f"An error inside WildCap stopped {stopped} ({name}, {type(error).__name__}: {first_line}).",
        KEPT + (f" The log is {log}." if log is not None else ""),
    )


def identify(error: BaseException) -> str:
    """Return an id such as WC-3f9a1c from the kind of an error and the functions it passed, without line numbers."""
    functions = [(Path(frame.filename).name, frame.name) for frame in traceback.extract_tb(error.__traceback__)]
    return f"WC-{hashlib.blake2b(repr((type(error).__name__, functions[-6:])).encode(), digest_size=3).hexdigest()}"
