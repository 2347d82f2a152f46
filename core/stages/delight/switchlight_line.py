# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Queue for SwitchLight: at most three calls at once, patience with a busy service, every whole answer kept at once.

A cancel is obeyed at once: calls under way are left to their threads, which keep what still comes for as long as the
process lives.
"""

from __future__ import annotations

import random
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from ...capture import switchlight_api as service
from ...capture.files import replacing
from ...capture.messages import Problem, Reporter
from ...imaging import images
from .switchlight_calls import Account, AgainError, albedo


@dataclass(frozen=True)
class Patience:
    """Limits of the tries for a picture.

    The wait doubles from `first_s` to `most_s`, at random between half of it and all of it.
    """

    tries: int = 6
    spoiled: int = 2  # answers that came broken and may have been charged: more are not risked
    first_s: float = 1.0
    most_s: float = 60.0
    silence_s: float = 30.0
    call_s: float = 120.0
    longest_s: float = 300.0  # a service that asks for a longer wait is given up


@dataclass(frozen=True)
class Parcel:
    """Frame as it is sent, and the path of its answer."""

    name: str
    data: bytes
    suffix: str
    answer: Path


def send(account: Account, parcels: list[Parcel], preview: bool, report: Reporter, patience: Patience) -> int:
    """Obtain and keep the answer to every parcel; return the number of calls.

    Raises Problem once the calls under way have ended; CancelledError at once.
    """
    line = _Line(account, parcels, preview, patience)
    threads = [
        threading.Thread(target=line.work, name=f"switchlight-{i}", daemon=True)
        for i in range(min(service.MOST_AT_ONCE, len(parcels)))
    ]
    try:
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            report.progress(line.done, len(parcels), line.text())
            threads[0 if threads[0].is_alive() else -1].join(0.1)
    finally:
        line.close()
    if line.error is not None:
        raise line.error
    return line.calls


class _Line:
    """State shared by the threads. After `error`, the first that no patience helps against, no call is started."""

    def __init__(self, account: Account, parcels: list[Parcel], preview: bool, patience: Patience):
        self.error: Exception | None = None
        self.done = self.calls = 0
        self._account, self._preview, self._patience = account, preview, patience
        self._waiting = list(reversed(parcels))
        self._of = len(parcels)
        self._lock = threading.Lock()
        self._closed, self._abandoned = threading.Event(), False
        self._not_before = 0.0
        self._reason = ""

    def close(self) -> None:
        """Start no call, end all waits, and give up the calls under way."""
        self._abandoned = True
        self._closed.set()

    def text(self) -> str:
        wait_s = self._not_before - time.monotonic()
        if wait_s > 0.5 and self._reason:
            return f"SwitchLight: {self._reason}, trying again in {wait_s:.0f} s"
        return f"SwitchLight: {self.done} of {self._of} frames have come"

    def work(self) -> None:
        """Handle one parcel after the other in a thread."""
        while not self._closed.is_set():
            with self._lock:
                if not self._waiting:
                    return
                parcel = self._waiting.pop()
            try:
                self._obtain(parcel)
            except Exception as error:  # raised by `send`
                self._stop(error)

    def _obtain(self, parcel: Parcel) -> None:
        spoiled = 0
        for attempt in range(self._patience.tries):
            if not self._wait():
                return
            with self._lock:
                self.calls += 1
            try:
                answer = albedo(
                    self._account,
                    parcel.data,
                    parcel.suffix,
                    self._preview,
                    self._patience.silence_s,
                    self._patience.call_s,
                    lambda: self._abandoned,
                )
                return self._keep(parcel, answer)
            except AgainError as error:
                spoiled += error.spoiled
                last = error
                if spoiled > self._patience.spoiled:
                    break
                self._postpone(error, attempt)
        self._stop(
            Problem(
                f"SwitchLight did not serve the frame {parcel.name}: {last.reason}, after {attempt + 1} tries.",
                f"Run again later: the {self.done} of {self._of} answers that came are kept and are not paid again.",
            )
        )

    def _keep(self, parcel: Parcel, answer: bytes) -> None:
        """Write an answer. Raises AgainError if it cannot be read as a picture, Problem if it cannot be written."""
        with replacing(parcel.answer) as temporary:
            temporary.write_bytes(answer)
            try:
                images.read_data(temporary)
            except Problem:
                raise AgainError("an answer that is no picture", spoiled=True) from None
        with self._lock:
            self.done += 1

    def _postpone(self, error: AgainError, attempt: int) -> None:
        """Make all threads wait as long as the service asks, and at least our own wait."""
        wait = min(self._patience.most_s, self._patience.first_s * 2**attempt) * random.uniform(0.5, 1.0)
        if error.after_s is not None and error.after_s > self._patience.longest_s:
            raise Problem(
                f"SwitchLight asks you to wait {error.after_s / 60:.0f} minutes.",
                "Run again then: the answers that came are kept.",
            )
        with self._lock:
            self._not_before = max(self._not_before, time.monotonic() + max(wait, error.after_s or 0.0))
            self._reason = error.reason

    def _wait(self) -> bool:
        """Wait until the service may be called; return False if the line is closed meanwhile."""
        while (wait_s := self._not_before - time.monotonic()) > 0:
            if self._closed.wait(wait_s):
                return False
        return not self._closed.is_set()

    def _stop(self, error: Exception) -> None:
        with self._lock:
            self.error = self.error or error
        self._closed.set()
