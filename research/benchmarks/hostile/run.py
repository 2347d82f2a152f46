# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A hostile case in a process of its own, with limits of memory and time, and the judgement of its end.

Each fault is a sentence.
"""

import math
import os
import re
import resource
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from core.capture import ownership

from ..kills.capture import BESIDE
from ..kills.judge import find_lost
from ..kills.worker import Forked, in_fork
from . import films
from .cases import Case

LIMIT_S = 90.0
"""Time after which a case counts as hanging: the dearest stage takes a fifth of it on a quiet core."""
MORE_BYTES, MOST_BYTES = 4 << 30, 3 << 30
"""Limit of address space beside the warmed process's, and of the memory in use."""


MOST_CODES = 3.0
"""Mean difference to the clean picture, of 255, from which a spoiled photograph must be told."""


@dataclass(frozen=True)
class Ended:
    """Exit code, negative for a signal; what was printed, to standard error, and to both; seconds; most memory."""

    code: int
    errors: str
    output: str
    seconds: float
    peak: int
    hung: bool = False


def run(case: Case) -> Ended:
    """Run the case's command as `python -m core` does, but with the worker in the same process."""
    log = case.place.with_suffix(".out")
    forked, hung = Forked(lambda: _command(case.command), case.place, log), False
    try:
        forked.wait(LIMIT_S)
    except TimeoutError:
        hung = True
    seconds, errors = time.monotonic() - forked.began, forked.errors
    output = log.read_text(encoding="utf-8", errors="replace") + errors
    return Ended(forked.code, errors, output, seconds, forked.peak, hung)


def _command(words: list[str]) -> int:
    """Run `python -m core WORDS` within the limit of memory, without a terminal."""
    from core import __main__ as program
    from core.capture.messages import Cancelled, Failed
    from core.worker.runner import run_job

    def follow(root, capture, job, environment) -> int:
        last = run_job(job)
        if isinstance(last, Failed):
            print(last.problem, last.remedy, sep="\n", file=sys.stderr)
        return 2 if isinstance(last, Failed) else 130 if isinstance(last, Cancelled) else 0

    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MORE_BYTES, resource.RLIM_INFINITY))
    program.terminal.follow = follow
    return program.main(words)


def judge(case: Case, ended: Ended) -> list[str]:
    """Find the faults of a case's end."""
    faults = []
    if ended.hung:
        faults.append(f"it did not end within {LIMIT_S:.0f} s")
    elif ended.code not in (0, 2):
        name = signal.Signals(-ended.code).name if ended.code < 0 else f"exit code {ended.code}"
        faults.append(f"it ended with {name}: {ended.errors[-300:]}")
    if "Traceback" in ended.output:
        faults.append(f"a traceback was shown: {ended.output[-300:]}")
    if "An error inside WildCap" in ended.output:
        faults.append(f"an error inside WildCap: {ended.errors.strip()[:300]}")
    if ended.peak > MOST_BYTES:
        faults.append(f"it took {ended.peak / 1e9:.1f} GB")
    if ended.code == 2 and not faults:
        faults += _judge_refusal(case, ended.errors)
    if ended.code == 0:
        faults += in_fork(lambda: _find_unsound(case) + _find_silence(case) + _find_silent_photograph(case))
    return faults + _find_lost(case)


def _judge_refusal(case: Case, errors: str) -> list[str]:
    lines = [line.rstrip() for line in errors.splitlines() if line.strip()][-2:]
    text = " ".join(lines)
    if len(lines) < 2 or not all(line.endswith((".", ")")) for line in lines):
        return [f"the refusal is no problem and remedy: {errors[-300:]!r}"]
    if not any(name in text for name in case.named):
        return [f"the refusal does not name {case.named[0]}: {text[:400]}"]
    return []


def _find_unsound(case: Case) -> list[str]:
    """Find outputs that are missing, cannot be read, or hold what is no finite number."""
    found, ours = [], ownership.read_record(case.root)[0]
    for path in (case.root / name for name in case.outputs):
        if not path.exists() and case.root.exists():
            found.append(f"{path.name} was not written")
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            name = file.relative_to(case.root).as_posix()
            fault = _unsound(file) if file.is_file() and name in ours else ""
            found += [f"{name} {fault}"] if fault else []
    return found


def _find_silence(case: Case) -> list[str]:
    """Find a film that was used in silence although its pictures are not those it shows, or a finding was due."""
    import json

    import numpy as np
    import OpenImageIO as oiio

    record = case.root / "capture.json"
    if case.clean is None or not record.is_file():
        return []
    findings = json.loads(record.read_text(encoding="utf-8"))["stages"].get("frames", {}).get("findings", [])
    if findings or case.outcome == films.ANY:
        return []
    if case.outcome == films.TOLD:
        return ["it was used in silence"]
    off = []
    for path in sorted((case.root / "frames").glob("*.jpg")):
        clean = case.clean / f"{path.stem}.png"
        if not clean.is_file():
            return [f"frame {path.stem} is none of the clean film's"]
        pictures = [oiio.ImageInput.open(str(each)).read_image("float")[..., :3] for each in (path, clean)]
        if pictures[0].shape != pictures[1].shape:
            return [f"frame {path.stem} has another size than the clean film's"]
        off.append(float(np.abs(pictures[0] - pictures[1]).mean()))
    if not off or np.mean(off) > films.MOST_OFF:
        return [f"it was used in silence, {255 * np.mean(off or [1]):.1f} codes off the clean picture"]
    return []


def _unsound(file: Path) -> str:
    """Return the fault of a file, '' if it has none, without the product's own readers."""
    import json

    import numpy as np
    import OpenImageIO as oiio
    import pycolmap

    finite = True
    if file.suffix in (".png", ".exr", ".jpg"):
        picture = oiio.ImageInput.open(str(file))
        pixels = picture.read_image("float") if picture else None
        if pixels is None:
            return "cannot be read"
        finite = np.isfinite(pixels).all()
    elif file.suffix == ".obj":
        lines = re.findall(r"^vt? (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
        finite = lines and all(math.isfinite(float(word)) for line in lines for word in line.split())
    elif file.suffix == ".json":
        text = file.read_text(encoding="utf-8")
        json.loads(text)
        finite = not re.search(r"[:\[,]\s*-?(NaN|Infinity)", text)
    elif file.name == "images.bin":
        model = pycolmap.Reconstruction(str(file.parent))
        poses = [image.cam_from_world() for image in model.images.values() if image.has_pose]
        finite = poses and all(np.isfinite(pose.matrix()).all() for pose in poses)
    return "" if finite else "holds what is no finite number"


def _find_silent_photograph(case: Case) -> list[str]:
    """Find a spoiled photograph that was used, no longer looks as it did, and is not named in a finding."""
    import json

    import numpy as np

    from core.imaging import images

    if case.sound_picture is None:
        return []
    name = case.spoiled.name
    told = json.loads((case.root / "capture.json").read_text(encoding="utf-8"))["stages"]["frames"]["findings"]
    records = json.loads((case.root / "frames" / "frames.json").read_text(encoding="utf-8"))["frames"]
    used = next((record for record in records if record["source"] == name), None)
    if used is None or any(name in finding["problem"] or used["name"] in finding["frames"] for finding in told):
        return []
    clean = images.read_srgb(case.sound_picture)
    linear = images.read_linear(case.root / "frames" / used["name"]) / np.array(used["gain"], np.float32)
    picture = images.linear_to_srgb(linear)
    clean = images.resize(clean, *picture.shape[1::-1]) if clean.shape != picture.shape else clean
    off = 255 * float(np.abs(picture - clean).mean())
    return [f"{name} is used in silence, {off:.1f} codes off"] if off > MOST_CODES else []


def _find_lost(case: Case) -> list[str]:
    """Find the user's files that are gone or changed, the spoiled one among them, and what was written elsewhere."""
    root, spoiled, found = case.root, case.spoiled, []
    if root.is_dir() and (root / "shopping.txt").exists():
        found += find_lost(case.place)
    if case.content is not None and spoiled.name not in ownership.BOOKS:  # these are written over
        kept = (root / ownership.KEPT).rglob(f"{spoiled.stem}*") if spoiled.is_relative_to(root) else ()
        if not any(path.is_file() and path.read_bytes() == case.content for path in (spoiled, *kept)):
            found.append(f"the spoiled {spoiled.relative_to(case.place)} is nowhere any more")
    expected = {root.name, BESIDE, "brought", "out", "chosen.json", *(Path(word).name for word in case.command)}
    elsewhere = {path.name for path in case.place.iterdir()} - expected
    return found + [f"{name} lies beside the capture" for name in sorted(elsewhere)]
