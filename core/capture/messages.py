# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a worker says: one JSON line per message, a closed set of kinds, and how a stage reports.

Ground floor: standard library only. A job ends with exactly one of Done, Cancelled or Failed.
"""

from __future__ import annotations

import json
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


class Problem(Exception):
    """A failure the user can act on: what is wrong, and what to do about it. Never shown as a traceback."""

    def __init__(self, problem: str, remedy: str):
        super().__init__(f"{problem} {remedy}")
        self.problem = problem
        self.remedy = remedy


def out_of_memory(error: BaseException) -> bool:
    """Whether Python, torch, OpenCV or NumPy say with it that memory did not suffice."""
    return isinstance(error, MemoryError) or any(words in str(error).lower() for words in NO_MEMORY)


def name_some(names: list[str], most: int = 4) -> str:
    """The first of the names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


class CancelledError(Exception):
    """Raised by `Reporter` inside a stage once the user has asked to stop."""


@dataclass(frozen=True)
class Progress:
    """A stage has done `done` of `of` units of work; `eta_s` seconds remain for the stage (None: unknown)."""

    stage: str
    done: float
    of: float
    text: str = ""
    eta_s: float | None = None


@dataclass(frozen=True)
class Log:
    """One line for whoever reads along."""

    text: str


@dataclass(frozen=True)
class Preview:
    """A picture of the capture folder has new content; `path` is relative to the capture."""

    stage: str
    path: str


@dataclass(frozen=True)
class StageDone:
    """A stage ended; `skipped` when it was fresh. `figures` are its quality figures."""

    stage: str
    seconds: float
    skipped: bool
    figures: dict


@dataclass(frozen=True)
class Done:
    """The job ended well."""

    seconds: float


@dataclass(frozen=True)
class Cancelled:
    """The job ended because the user asked; what was finished is kept."""

    stage: str


@dataclass(frozen=True)
class Failed:
    """The job ended with a problem and its remedy, both whole sentences."""

    stage: str
    problem: str
    remedy: str


KINDS = {kind.__name__: kind for kind in (Progress, Log, Preview, StageDone, Done, Cancelled, Failed)}
FINAL = (Done, Cancelled, Failed)
Message = Progress | Log | Preview | StageDone | Done | Cancelled | Failed


def to_line(message: Message) -> str:
    """One JSON line without its newline; non-ASCII escaped, so that any pipe encoding carries it."""
    return json.dumps({"kind": type(message).__name__, **asdict(message)})


def from_line(line: str) -> Message:
    """The message of one line. Raises ValueError for anything that is not one."""
    fields = json.loads(line)
    if not isinstance(fields, dict) or fields.get("kind") not in KINDS:
        raise ValueError(f"not a worker message: {line[:80]!r}")
    kind = KINDS[fields.pop("kind")]
    try:
        return kind(**fields)
    except TypeError as error:
        raise ValueError(str(error)) from error


class Reporter:
    """How a stage speaks: progress, log lines, previews and quality figures; and where it hears of a cancel.

    Every call but `figure` raises CancelledError once `cancelled()` is true, so a stage that reports often
    (several times a second) can be stopped at any report without code of its own.
    """

    def __init__(
        self,
        stage: str,
        emit: Callable[[Message], None] = lambda message: None,
        cancelled: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] | None = None,
    ):
        import time

        self.stage = stage
        self.figures: dict = {}
        self.findings: list[dict] = []
        self._emit = emit
        self._cancelled = cancelled
        self._clock = clock or time.monotonic
        self._first: tuple[float, float] | None = None  # the first units that were reported as done, and when
        self._last = (0.0, 0.0)  # what was reported as done before, and of how many

    def check(self) -> None:
        """Raises CancelledError if the user asked to stop."""
        if self._cancelled():
            raise CancelledError(self.stage)

    def progress(self, done: float, of: float, text: str = "") -> None:
        """`done` of `of` equal units are finished. The ETA is what is left at the pace since the first finished unit
        was reported: what comes before it (reading, or going on from a checkpoint) says nothing about the pace. A stage
        begins another count by another `of`, or from less than was done."""
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
        self.check()
        self._emit(Log(text))

    def preview(self, path: str) -> None:
        """`path` is relative to the capture folder."""
        self.check()
        self._emit(Preview(self.stage, path))

    def figure(self, name: str, value) -> None:
        """A quality figure (JSON value) for capture.json and the report; a name of lower_case words with its unit
        last."""
        self.figures[name] = value

    def finding(self, problem: str, remedy: str, frames: Collection[str] = ()) -> None:
        """What is wrong with this capture though it can be used, how to shoot it better (both whole sentences), and the
        frames it is seen in.

        Kept in capture.json, listed at the top of the report, and logged.
        """
        self.findings.append({"problem": problem, "remedy": remedy, "frames": list(frames)})
        self.log(f"{problem} {remedy}")
