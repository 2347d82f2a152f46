# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A hostile case in a process of its own, with limits of memory and time, and the judgement of how it ended. Each fault
is a sentence."""

from __future__ import annotations

import math
import os
import re
import resource
import signal
import sys
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from core.capture import ownership

from ..kills.capture import BESIDE, capture_at
from ..kills.judge import find_lost
from ..kills.worker import in_fork
from .cases import Case, is_book

LIMIT_S = 90.0
"""After which a case counts as hanging: the dearest stage takes a fifth of it on a quiet core."""
MORE_BYTES = 4 << 30
"""Of address space beside what the warmed process has; and what it may come to use of it."""
MOST_BYTES = 3 << 30


@dataclass(frozen=True)
class Ended:
    """Exit code, negative for a signal; what was printed to both streams, and to the second alone; seconds; the most
    memory in bytes; whether it hung."""

    code: int
    output: str
    errors: str
    seconds: float
    peak: int
    hung: bool


def run(case: Case) -> Ended:
    """Run the case's command line as `python -m core` does, but for the worker, which is this process's own fork and
    not a new Python."""
    told = case.place.with_suffix(".out"), case.place.with_suffix(".err")
    sys.stdout.flush()
    began = time.monotonic()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            os.setsid()
            for number, path in zip((1, 2), told, strict=True):
                os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o666), number)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (taken + MORE_BYTES, resource.RLIM_INFINITY))
            code = _command(case.command)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    hung = False
    while True:
        ended, status, used = os.wait4(pid, os.WNOHANG)
        if ended:
            break
        if time.monotonic() - began > LIMIT_S and not hung:
            hung = True
            os.killpg(pid, signal.SIGKILL)
        time.sleep(0.002)
    output, errors = (path.read_text(encoding="utf-8", errors="replace") for path in told)
    for path in told:
        path.unlink()
    return Ended(
        os.waitstatus_to_exitcode(status),
        output + errors,
        errors,
        time.monotonic() - began,
        used.ru_maxrss * 1024,
        hung,
    )


def _command(words: list[str]) -> int:
    """`python -m core WORDS` with the worker in this process."""
    from core import __main__ as program
    from core.capture.messages import Cancelled, Failed
    from core.worker.runner import run_job

    def follow(root, capture, job, environment) -> int:
        last = run_job(job)
        if isinstance(last, Failed):
            print(last.problem, last.remedy, sep="\n", file=sys.stderr)
        return 2 if isinstance(last, Failed) else 130 if isinstance(last, Cancelled) else 0

    program.terminal.follow = follow
    return program.main(words)


def judge(case: Case, ended: Ended) -> list[str]:
    """What was not as it has to be."""
    faults = []
    if ended.hung:
        faults.append(f"it did not end within {LIMIT_S:.0f} s")
    elif ended.code not in (0, 2):
        faults.append(
            f"it ended with "
            f"{signal.Signals(-ended.code).name if ended.code < 0 else f'exit code {ended.code}'}: "
            f"{ended.errors[-300:]}"
        )
    if "Traceback" in ended.output:
        faults.append(f"a traceback was shown: {ended.output[-300:]}")
    if "An error inside WildCap" in ended.output:
        faults.append(f"an error inside WildCap: {ended.errors.strip()[:300]}")
    if ended.peak > MOST_BYTES:
        faults.append(f"it took {ended.peak / 1e9:.1f} GB")
    if ended.code == 2 and not faults:
        faults += _refusal(case, ended)
    if ended.code == 0:
        faults += in_fork(lambda: find_unsound(case))
    return faults + _lost(case)


def _refusal(case: Case, ended: Ended) -> list[str]:
    lines = [line for line in ended.errors.splitlines() if line.strip()]
    if len(lines) < 2 or not all(line.rstrip().endswith((".", ")")) for line in lines[-2:]):
        return [f"the refusal is no problem and remedy: {ended.errors[-300:]!r}"]
    text = " ".join(lines[-2:])
    return (
        [] if any(name in text for name in case.named) else [f"the refusal does not name {case.named[0]}: {text[:400]}"]
    )


def find_unsound(case: Case) -> list[str]:
    """Outputs of what ended well that are missing, cannot be read, or hold what is no finite number."""
    root, found = capture_at(case.place).root, []
    for name in case.outputs:
        path = root / name
        if not path.exists():
            if root.exists():
                found.append(f"{name} was not written")
            continue
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            fault = _unsound(file) if file.is_file() and file.relative_to(root).as_posix() in _ours(root) else ""
            found += [f"{file.relative_to(root)} {fault}"] if fault else []
    return found


def _ours(root: Path) -> set[str]:
    return set(ownership.read_record(root)[0])


def _unsound(file: Path) -> str:
    """Judged without the product's own readers."""
    import json

    import numpy as np
    import OpenImageIO as oiio
    import pycolmap

    if file.suffix in (".png", ".exr", ".jpg"):
        picture = oiio.ImageInput.open(str(file))
        pixels = picture.read_image("float") if picture else None
        return (
            "cannot be read"
            if pixels is None
            else ""
            if np.isfinite(pixels).all()
            else "holds what is no finite number"
        )
    if file.suffix == ".obj":
        numbers = re.findall(r"^vt? (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
        return (
            ""
            if numbers and all(math.isfinite(float(word)) for line in numbers for word in line.split())
            else "holds what is no finite number"
        )
    if file.suffix == ".json":
        text = file.read_text(encoding="utf-8")
        json.loads(text)
        return "holds NaN or Infinity" if re.search(r"[:\[,]\s*-?(NaN|Infinity)", text) else ""
    if file.name == "images.bin":
        model = pycolmap.Reconstruction(str(file.parent))
        poses = [image.cam_from_world() for image in model.images.values() if image.has_pose]
        return "" if poses and all(np.isfinite(pose.matrix()).all() for pose in poses) else "has no finite poses"
    return ""


def _lost(case: Case) -> list[str]:
    """The user's files that are gone or changed, the spoiled one among them, and what was written elsewhere."""
    found = []
    root = capture_at(case.place).root
    if root.is_dir() and (root / "shopping.txt").exists():
        found += find_lost(case.place)
    if case.content is not None and not is_book(case):
        inside = case.spoiled.relative_to(root).as_posix() if case.spoiled.is_relative_to(root) else None
        places = [case.spoiled, *((root / ownership.KEPT).rglob(f"{case.spoiled.stem}*") if inside else ())]
        if not any(path.is_file() and path.read_bytes() == case.content for path in places):
            found.append(f"{case.spoiled.relative_to(case.place)}, as it was spoiled, is nowhere any more")
    words = {Path(word).name for word in case.command}
    expected = {root.name, BESIDE, "brought", "out", "chosen.json", *words}
    elsewhere = {path.name for path in case.place.iterdir()} - expected
    return found + [f"{name} lies beside the capture" for name in sorted(elsewhere)]
