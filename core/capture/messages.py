# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's protocol, one JSON line per message, and the Reporter by which a stage sends it.

A job ends with exactly one of Done, Cancelled or Failed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass

NO_MEMORY = (
    "out of memory",
    "not enough memory",
    "can't allocate memory",
    "cannot allocate memory",
    "insufficient memory",
    "bad_alloc",
    "unable to allocate",
)
"""Words of Python, torch, OpenCV and NumPy."""


class Problem(Exception):
    """Failure the user can act on: a problem and its remedy, both whole sentences."""

    def __init__(self, problem: str, remedy: str):
        super().__init__(f"{problem} {remedy}")
        self.problem = problem
        self.remedy = remedy


def out_of_memory(error: BaseException) -> bool:
    """Return whether an error of any library means that memory ran out."""
    return isinstance(error, MemoryError) or any(words in str(error).lower() for words in NO_MEMORY)


def name_some(names: list[str], most: int = 4) -> str:
    """Join the first names, and count the others."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


class CancelledError(Exception):
    """Raised by `Reporter` inside a stage after the user cancelled."""


@dataclass(frozen=True)
class Progress:
    """`done` of `of` units of a stage are finished; `eta_s` seconds remain (None: unknown)."""

    stage: str
    done: float
    of: float
    text: str = ""
    eta_s: float | None = None


@dataclass(frozen=True)
class Log:
    """One line for the log."""

    text: str


@dataclass(frozen=True)
class Preview:
    """New content of a picture in the capture; `path` is relative to the capture folder."""

    stage: str
    path: str


@dataclass(frozen=True)
class StageDone:
    """End of a stage; `skipped` if it was fresh. `figures` are its quality figures."""

    stage: str
    seconds: float
    skipped: bool
    figures: dict


@dataclass(frozen=True)
class Done:
    """Success of the job."""

    seconds: float


@dataclass(frozen=True)
class Cancelled:
    """End of a job that the user cancelled; finished stages are kept."""

    stage: str


@dataclass(frozen=True)
class Failed:
    """Failure of the job by a Problem."""

    stage: str
    problem: str
    remedy: str


KINDS = {kind.__name__: kind for kind in (Progress, Log, Preview, StageDone, Done, Cancelled, Failed)}
FINAL = (Done, Cancelled, Failed)
Message = Progress | Log | Preview | StageDone | Done | Cancelled | Failed


def to_line(message: Message) -> str:
    """Write a message as one line of ASCII JSON, without its newline."""
    return json.dumps({"kind": type(message).__name__, **asdict(message)})


def from_line(line: str) -> Message:
    """Parse the message of one line. Raises ValueError for anything else."""
    fields = json.loads(line)
    if not isinstance(fields, dict) or fields.get("kind") not in KINDS:
        raise ValueError(f"not a worker message: {line[:80]!r}")
    kind = KINDS[fields.pop("kind")]
    try:
        return kind(**fields)
    except TypeError as error:
        raise ValueError(str(error)) from error


class Reporter:
    """Progress, log, previews, quality figures and findings of a stage.

    Every call but `figure` raises CancelledError once `cancelled()` is true, so a stage that reports several times a
    second needs no code of its own for a cancel.
    """

    def __init__(
        self,
        stage: str,
        emit: Callable[[Message], None] = lambda message: None,
        cancelled: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.stage = stage
        self.figures: dict = {}
        self.findings: list[dict] = []
        self._emit = emit
        self._cancelled = cancelled
        self._clock = clock
        self._first: tuple[float, float] | None = None  # first units reported as done, and when
        self._last = (0.0, 0.0)  # previous units, and of how many

    def check(self) -> None:
        """Raise CancelledError if the user cancelled."""
        if self._cancelled():
            raise CancelledError(self.stage)

    def progress(self, done: float, of: float, text: str = "") -> None:
        """Report `done` of `of` equal units. A new `of`, or a smaller `done`, begins another count.

        The ETA follows the pace since the first finished unit: reading files, or units of a checkpoint, do not count.
        """
        self.check()
        now = self._clock()
        if of != self._last[1] or done < self._last[0]:
            self._first = None
        self._last = done, of
        if self._first is None and done > 0:
            self._first = done, now
        paced = self._first is not None and done > self._first[0]
        eta = (now - self._first[1]) * (of - done) / (done - self._first[0]) if paced else None
        self._emit(Progress(self.stage, float(done), float(of), text, eta))

    def log(self, text: str) -> None:
        """Log one line."""
        self.check()
        self._emit(Log(text))

    def preview(self, path: str) -> None:
        """Announce a picture; `path` is relative to the capture folder."""
        self.check()
        self._emit(Preview(self.stage, path))

    def figure(self, name: str, value) -> None:
        """Record a quality figure, a JSON value, for capture.json and the report. The unit ends its name."""
        self.figures[name] = value

    def finding(self, problem: str, remedy: str, frames: Collection[str] = ()) -> None:
        """Record a flaw of a usable capture, how to film it better, and the frames that show it.

        It is logged, kept in capture.json and listed at the top of the report.
        """
        self.findings.append({"problem": problem, "remedy": remedy, "frames": list(frames)})
        self.log(f"{problem} {remedy}")
