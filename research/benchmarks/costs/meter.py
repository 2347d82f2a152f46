# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds, processor seconds and memory, measured in one way for all that is measured: of a block in this process, or
of a process that is started for it (`run_alone`), beside which the machine may do other things."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
COUNTERS = Path("/proc/stat")
"""Linux's counters of what its processors did (proc(5))."""
MIB, GIB = 2**20, 2**30


@dataclass
class Spent:
    """Seconds by the clock, and of the processors, summed over the threads of this process."""

    seconds: float = 0.0
    processor_s: float = 0.0


@contextmanager
def spending() -> Iterator[Spent]:
    """What its block takes, known when it has ended."""
    spent, began, own = Spent(), time.perf_counter(), own_s()[0]
    yield spent
    spent.seconds, spent.processor_s = time.perf_counter() - began, own_s()[0] - own


@dataclass(frozen=True)
class ProcessCost:
    """What a process took. code: its exit code, None where it was ended at the limit; said: its output; seconds: its
    whole life; processor_s: summed over its threads, its children's included; load: the machine's load average (one
    minute) before; others: cores that all other processes took meanwhile (the hypervisor's share included), None where
    the system does not count them."""

    code: int | None
    said: str
    seconds: float
    processor_s: float
    load: float
    others: float | None

    def checked(self) -> ProcessCost:
        """The same. Raises ChildProcessError where the process failed or was ended; it has said why."""
        if self.code != 0:
            raise ChildProcessError(f"the process ended with code {self.code}")
        return self


def run_alone(words: Sequence[str], limit_s: float | None = None, quiet: bool = False) -> ProcessCost:
    """Runs Python with these words in the checkout, in a session of its own that is ended after `limit_s` seconds, its
    own children with it. quiet: what it says on stderr is dropped."""
    load, busy, own, began = round(os.getloadavg()[0], 2), busy_s(), own_s(), time.monotonic()
    child = subprocess.Popen(
        [sys.executable, *words],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        stderr=subprocess.DEVNULL if quiet else None,
        start_new_session=True,
    )
    said, code = "", None
    try:
        said = child.communicate(timeout=limit_s)[0]
        code = child.returncode
    except subprocess.TimeoutExpired:
        pass
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
    seconds, (mine, theirs) = time.monotonic() - began, own_s()
    mine, theirs = mine - own[0], theirs - own[1]
    others = None if busy is None else round(max(busy_s() - busy - mine - theirs, 0.0) / seconds, 2)
    return ProcessCost(code, said, seconds, theirs, load, others)


def busy_s() -> float | None:
    """Seconds that this machine's processors have worked since it was started, summed; None where the system does not
    tell."""
    try:
        return busy_of(COUNTERS.read_text(encoding="ascii"))
    except OSError:
        return None


def busy_of(counters: str) -> float:
    """The same from the text of /proc/stat: user, nice, system, irq, softirq and steal of all processors; not idle and
    iowait; guests are within user."""
    user, nice, system, _, _, irq, softirq, steal = map(int, counters.split(maxsplit=9)[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


def own_s() -> tuple[float, float]:
    """Seconds of the processors that this process has taken, and its children that have ended with theirs."""
    used = os.times()
    return time.process_time(), used.children_user + used.children_system


def resident() -> int:
    """Bytes that this process holds in memory now (Linux)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def peak(children: bool = False) -> int:
    """The most bytes that this process, or with `children` one of its children that have ended, held in memory."""
    import resource  # Windows has none

    unit = 1 if sys.platform == "darwin" else 1024  # macOS counts bytes, Linux KiB
    return max(
        _own_peak() or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit,
        resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit if children else 0,
    )


def _own_peak() -> int | None:
    """Linux's own count, which does not hold what the process that started this one had; None elsewhere."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
