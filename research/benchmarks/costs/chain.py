# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of the whole chain on the sample video, stage by stage, and how they grow with resolution, grid,
views and frames.

    python -m research.benchmarks.costs chain WORK --json OUT.json [--rows standard draft solve-2048 ...] [--capture
    CAPTURE]
                                     [--film VIDEO] [--limit-s 600] [--again]

Every stage runs in a process of its own (stage.py). "standard" goes from the video to the delivery; the other rows
start from a copy of what it made in WORK, or of --capture. OUT.json is written after each stage: the same command goes
on where it was stopped. A stage that takes longer than --limit-s is ended and told as "over"; one beside which other
processes took more than 0.2 cores is told with that, and is measured once more with --again. "float32" is the standard
solve and 4K stage with the networks as a processor without bfloat16 runs them. The rows frames-N are the whole chain on
N frames of --film; without it, of the sample's 60 played to and fro,
with new noise in every frame: more pictures, not more to see."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import av
import numpy as np

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import replacing_folder
from core.capture.frame_records import read_frames, write_frames
from core.capture.messages import Problem
from core.stages.solve.prior_files import fast_dtype

from .. import figures
from ..films import read_film
from .rows import GROWTH, ROWS, WHOLES, StageRun, cell, disturbed, growth, table, together
from .stage import measure_stage

VIDEO = figures.ROOT / "research" / "people" / "sample" / "capture.mp4"
NOISE = 1.5
"""Deviation of a repeated frame's noise, in steps of 255."""
LEFT_OUT = shutil.ignore_patterns(
    "maps*", "checkpoints", "comparison", "delivery", "exports", "renders", "report*", "logs", "lock", "job.json"
)
"""What a copy of a finished capture does without: each row solves before it needs maps."""


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        "python -m research.benchmarks.costs chain",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("work", type=Path)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=list(ROWS))
    parser.add_argument(
        "--capture", type=Path, help="a finished capture of the sample to copy, for rows without the row standard"
    )
    parser.add_argument("--film", type=Path, help="a long video, for the rows frames-N")
    parser.add_argument("--limit-s", type=float, default=600, help="seconds that a stage may take")
    parser.add_argument("--again", action="store_true", help="measure once more what other processes disturbed")
    options = parser.parse_args(arguments)
    try:
        failed = [name for name in options.rows if not measured(name, options)]
    except Problem as problem:
        parser.error(f"{problem.problem} {problem.remedy}")
    except KeyboardInterrupt:
        sys.exit("\nStopped; the same command goes on from here.")
    print(table(figures.read_record(options.json.stem, options.json.parent)["figures"]))
    if failed:
        sys.exit(f"Not measured to the end: {', '.join(failed)}.")


def measured(name: str, options: argparse.Namespace) -> bool:
    """Measures a row's stages that the JSON does not have yet (or has disturbed, with options.again: the less disturbed
    one stays); False where one failed, which is printed. Raises Problem where it has nothing to start from."""
    row, found = (
        ROWS[name],
        figures.read_record(options.json.stem, options.json.parent)["figures"] if options.json.exists() else {},
    )
    here = machine()
    if other := [what for what, value in found.get("machine", {}).items() if value != here[what]]:
        raise Problem(
            f"{options.json} was measured on another machine ({', '.join(other)}).",
            "Name a new --json: one table holds one machine's costs.",
        )
    costs = found.setdefault(name, {})
    found["machine"] = here
    capture = options.work / f"{name}.wildcap"
    left = [stage for stage in row.stages if stage not in costs or (options.again and disturbed(costs[stage]))]
    # what comes after a stage without end cannot be measured
    if not left or any("over_s" in cost for cost in costs.values()):
        return True
    begun = capture.exists()
    source = prepare(row, capture, options)
    for stage in left if begun else row.stages:
        print(f"{name}: {stage} ...", end=" ", flush=True)
        cost = measure_stage(capture, stage, source, row.quality, row.settings, options.limit_s, row.float32)
        if "problem" in cost:
            print(cost["problem"], cost["remedy"])
            return False
        known = costs.get(stage)
        if known is None or "over_s" not in cost and (cost["others"] or 0) <= (known["others"] or 0):
            costs[stage] = cost
        print(cell(cost), flush=True)
        found["together"] = {whole: costs_of for whole in WHOLES if (costs_of := together(found, whole))}
        found["growth"] = {
            title: exponents for title, values, grown in GROWTH if (exponents := growth(found, values, grown))
        }
        figures.write_record(
            options.json, "costs", "python -m research.benchmarks.costs chain WORK --json OUT.json", found
        )
        if "over_s" in cost:
            break
    if name != "standard":
        shutil.rmtree(capture)
    return True


def prepare(row: StageRun, capture: Path, options: argparse.Namespace) -> Path:
    """Makes the row's capture where it is not there yet, and returns its video. Raises Problem where it begins with
    what nobody made."""
    base = options.work / "standard.wildcap"
    if options.capture and not base.exists():
        with replacing_folder(base) as folder:
            shutil.copytree(options.capture, folder, ignore=LEFT_OUT, dirs_exist_ok=True)
    reads = stages.by_name(row.stages[0]).reads
    missing = [name for name in reads if not Capture(base).has(name)]
    if missing:
        raise Problem(
            f"There is no {missing[0]} of the sample to start from in {base}.",
            "Measure the row standard first, or name a finished --capture.",
        )
    if reads and not capture.exists():
        with replacing_folder(capture) as folder:
            shutil.copytree(base, folder, ignore=LEFT_OUT, dirs_exist_ok=True)
            if row.views:
                select(Capture(folder), row.views)
    if row.frames and options.film:
        return options.film
    if row.frames <= length(VIDEO):
        return VIDEO
    video = options.work / f"frames-{row.frames}.mp4"
    if not video.exists():
        from ...people.sample import write_video

        write_video(video, to_and_fro(list(read_film(VIDEO)), row.frames))
    return video


def select(capture: Capture, count: int) -> None:
    """Has the frames stage's own choice of so many views written to frames.json."""
    from core.stages.frames.select import select_views, turns

    frames = read_frames(capture)
    chosen = select_views(np.array([record.sharpness for record in frames.records]), turns(frames.records), count)
    write_frames(
        capture.frames,
        replace(
            frames, records=tuple(replace(record, selected=i in chosen) for i, record in enumerate(frames.records))
        ),
    )


def length(video: Path) -> int:
    with av.open(str(video)) as container:
        return container.streams.video[0].frames


def to_and_fro(frames: list[np.ndarray], count: int) -> Iterator[np.ndarray]:
    """`count` frames, sRGB float32 [H, W, 3]: those given (uint8), then back to the first, forth again and so on, each
    with noise of its own."""
    random = np.random.default_rng(0)
    for number in range(count):
        at = number % (2 * len(frames) - 2)
        frame = frames[min(at, 2 * len(frames) - 2 - at)].astype(np.float32)
        yield np.clip(frame + NOISE * random.standard_normal(frame.shape, np.float32), 0, 255) / 255


def machine() -> dict:
    """What the figures were measured on; networks: the precision in which the processor runs them."""
    return {**figures.machine(), "networks": str(fast_dtype("cpu")).removeprefix("torch.")}
