# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard output that may be closed, as of `| head`, or full: whoever writes to it ends quietly.

Standard library only.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys

CLOSED, UNWRITTEN = 141, 1
"""Exit codes: of a program that SIGPIPE ends, in a shell; and of one whose output could not be written."""


class OutputLost(Exception):  # noqa: N818
    """Standard output takes no more. No OSError, which means a file's trouble, and which argparse passes over."""

    def __init__(self, cause: OSError):
        super().__init__(str(cause))
        self.code = CLOSED if isinstance(cause, BrokenPipeError) else UNWRITTEN


class Output(io.TextIOWrapper):
    """Standard output that raises OutputLost."""

    def write(self, text: str) -> int:
        with _telling():
            return super().write(text)

    def flush(self) -> None:
        with _telling():
            super().flush()


def open_streams() -> None:
    """Make standard streams that the caller closed, have the others take every character, and watch the output."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(getattr(sys, name), "reconfigure"):  # a log on Windows does not take every character
            getattr(sys, name).reconfigure(errors="backslashreplace")
    if type(sys.stdout) is io.TextIOWrapper:
        lines, encoding = sys.stdout.line_buffering, sys.stdout.encoding
        sys.stdout = Output(sys.stdout.detach(), encoding, "backslashreplace", line_buffering=lines)


def let_go() -> None:
    """Throw away what could not be written, or Python would complain at its exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def _telling():
    try:
        yield
    except OSError as error:
        raise OutputLost(error) from error
