# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of the whole chain on the sample video, stage by stage, and how they grow with resolution, grid,
views and frames.

    python -m benchmarks.costs WORK --json OUT.json [--rows standard draft solve-2048 ...] [--capture CAPTURE] [--film
    VIDEO] [--limit-s 600] [--again]

Every stage runs in a process of its own (benchmarks/stage_cost.py). "standard" goes from the video to the delivery; the
other rows start from a copy of what it made in WORK, or of --capture. OUT.json is written after each stage: the same
command goes on where it was stopped. A stage that takes longer than --limit-s is ended and told as "over"; one beside
which other processes took more than 0.2 cores is told with that, and is measured once more with --again. "float32" is
the standard solve and 4K stage with the networks as a processor without bfloat16 runs them. The rows frames-N are the
whole chain on N frames of --film, such as that of benchmarks.long_films; without it, of the sample's 60 played to and
fro, with new noise in every frame: more pictures, not more to see. Exponents are fits of the logarithm of the
processor's seconds to that of the size, over as many points as are told: for a map's side 2 is linear in texels.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import av
import numpy as np

from core.contract import stages
from core.contract.capture import Capture
from core.contract.files import replacing_folder
from core.contract.frame_records import read_frames, write_frames
from core.contract.messages import Problem
from core.solve.prior import fast_dtype

from . import figures, stage_cost

VIDEO = Path(__file__).resolve().parent.parent / "core" / "synthetic" / "sample" / "capture.mp4"
NOISE = 1.5
"""Deviation of a repeated frame's noise, in steps of 255."""
DISTURBED = 0.2
"""Cores that others took during a measurement, from which on the table says so."""
LEFT_OUT = shutil.ignore_patterns("maps*", "checkpoints", "comparison", "delivery", "exports", "renders", "report*",
                                  "logs", "lock", "job.json")
"""What a copy of a finished capture does without: each row solves before it needs maps."""


@dataclass(frozen=True)
class StageRun:
    """What is run: these stages in order, with the settings {stage: {name: value}} over the preset `quality`. frames:
    of a video of so many frames, from nothing; views: so many of the frames are selected (V); float32: whatever the
    processor can do, the networks compute in that."""

    stages: tuple[str, ...]
    settings: dict = field(default_factory=dict)
    quality: str = "standard"
    frames: int = 0
    views: int = 0
    float32: bool = False


LENGTHS = (60, 120, 300, 1000)
ROWS = {
    "standard": StageRun(stages.NAMES),
    # frames and cameras have the same settings in both
    "draft": StageRun(stages.NAMES[stages.NAMES.index("scan"):], quality="draft"),
    "float32": StageRun(("solve", "upscale"), float32=True),
    **{f"solve-{size}": StageRun(("solve",), {"solve": {"size": size}}) for size in (512, 2048)},
    **{f"texture-{size}": StageRun(("texture",), {"texture": {"size": size}}) for size in (512, 2048)},
    **{f"grid-{cells}": StageRun(("solve",), {"solve": {"grid_cells": cells}}) for cells in (384, 1, 24)},
    **{f"views-{count}": StageRun(("delight", "texture"), views=count) for count in (8, 32)},
    **{f"frames-{count}": StageRun(stages.NAMES, {"frames": {"max_frames": count}}, frames=count) for count in LENGTHS},
}
"""In the order of what matters most."""
WHOLES = ("standard", "float32", "draft", *(f"frames-{count}" for count in LENGTHS))
"""Rows that are a whole chain, with the standard row's costs of the stages they do not measure."""
GROWTH = (
    ("side of the map", (512, 1024, 2048),
     {"texture": ("texture-512", "standard", "texture-2048"), "solve": ("solve-512", "standard", "solve-2048"),
      "upscale": ("draft", "standard", "")}),
    ("cells of the light grid", (1, 24, 96, 384), {"solve": ("grid-1", "grid-24", "standard", "grid-384")}),
    ("views", (8, 16, 32), dict.fromkeys(("delight", "texture"), ("views-8", "standard", "views-32"))),
    ("frames", LENGTHS, dict.fromkeys(stages.NAMES, tuple(f"frames-{count}" for count in LENGTHS))),
)
"""What the tables of growth show: a setting, its values, and for each stage the rows that measured it there."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=list(ROWS))
    parser.add_argument("--capture", type=Path,
                        help="a finished capture of the sample to copy, for rows without the row standard")
    parser.add_argument("--film", type=Path, help="a long video, for the rows frames-N")
    parser.add_argument("--limit-s", type=float, default=600, help="seconds that a stage may take")
    parser.add_argument("--again", action="store_true", help="measure once more what other processes disturbed")
    options = parser.parse_args()
    try:
        failed = [name for name in options.rows if not measured(name, options)]
    except Problem as problem:
        parser.error(f"{problem.problem} {problem.remedy}")
    except KeyboardInterrupt:
        sys.exit("\nStopped; the same command goes on from here.")
    print(table(figures.read(options.json.stem, options.json.parent)["figures"]))
    if failed:
        sys.exit(f"Not measured to the end: {', '.join(failed)}.")


def measured(name: str, options: argparse.Namespace) -> bool:
    """Measures a row's stages that the JSON does not have yet (or has disturbed, with options.again: the less disturbed
    one stays); False where one failed, which is printed. Raises Problem where it has nothing to start from."""
    row, found = (ROWS[name],
                  figures.read(options.json.stem, options.json.parent)["figures"] if options.json.exists() else {})
    here = machine()
    if other := [what for what, value in found.get("machine", {}).items() if value != here[what]]:
        raise Problem(f"{options.json} was measured on another machine ({', '.join(other)}).",
                      "Name a new --json: one table holds one machine's costs.")
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
        cost = stage_cost.measure(capture, stage, source, row.quality, row.settings, options.limit_s, row.float32)
        if "problem" in cost:
            print(cost["problem"], cost["remedy"])
            return False
        known = costs.get(stage)
        if known is None or "over_s" not in cost and (cost["others"] or 0) <= (known["others"] or 0):
            costs[stage] = cost
        print(cell(cost), flush=True)
        found["together"] = {whole: costs_of for whole in WHOLES if (costs_of := together(found, whole))}
        found["growth"] = {title: exponents for title, values, grown in GROWTH
                           if (exponents := growth(found, values, grown))}
        figures.write(options.json, "costs", "python -m benchmarks.costs WORK --json OUT.json", found)
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
        raise Problem(f"There is no {missing[0]} of the sample to start from in {base}.",
                      "Measure the row standard first, or name a finished --capture.")
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
        from core.synthetic.sample import write_video

        write_video(video, to_and_fro(decoded(VIDEO), row.frames))
    return video


def select(capture: Capture, count: int) -> None:
    """Has the frames stage's own choice of so many views written to frames.json."""
    from core.frames.select import select_views, turns

    frames = read_frames(capture)
    chosen = select_views(np.array([record.sharpness for record in frames.records]), turns(frames.records), count)
    write_frames(capture.frames,
                 replace(frames,
                         records=tuple(replace(record, selected=i in chosen)
                                       for i, record in enumerate(frames.records))))


def length(video: Path) -> int:
    with av.open(str(video)) as container:
        return container.streams.video[0].frames


def decoded(video: Path) -> list[np.ndarray]:
    """All frames, uint8 [H, W, 3]."""
    with av.open(str(video)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


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


def together(found: dict, whole: str) -> dict | None:
    """Minutes, the processor's minutes, peak memory and the most that others took, over all stages of a row of WHOLES;
    None where one was not measured."""
    costs = [stage_of(found, whole, stage) for stage in stages.NAMES]
    if any(cost is None or "over_s" in cost for cost in costs):
        return None
    others = [cost["others"] for cost in costs if cost["others"] is not None]
    return {"minutes": round(sum(cost["seconds"] for cost in costs) / 60, 1),
            "processor_minutes": round(sum(cost["processor_s"] for cost in costs) / 60, 1),
            "peak_mb": max(cost["peak_mb"] for cost in costs), "others": max(others) if others else None}


def stage_of(found: dict, whole: str, stage: str) -> dict | None:
    """A stage's cost in a row of WHOLES; the standard one's where it does the same."""
    return found.get(whole if stage in ROWS[whole].stages else "standard", {}).get(stage)


def growth(found: dict, values: tuple[int, ...], grown: dict[str, tuple[str, ...]]) -> dict[str, dict]:
    """Stage -> the power of the size with which its processor seconds grow, and the number of sizes it was fitted to;
    without stages with fewer than two."""
    exponents = {}
    for stage, rows in grown.items():
        known = [(value, cost["processor_s"]) for value, row in zip(values, rows, strict=True)
                 if "processor_s" in (cost := found.get(row, {}).get(stage, {}))]
        if len(known) > 1:
            exponents[stage] = {"exponent": round(float(np.polyfit(*np.log(known).T, 1)[0]), 2), "points": len(known)}
    return exponents


def table(found: dict) -> str:
    """The Markdown tables: the chain stage by stage, then what grows with what."""
    shown = WHOLES[:3]
    chain = [[stage, *(cell(stage_of(found, whole, stage)) for whole in shown)] for stage in stages.NAMES]
    tables = [figures.markdown(["stage: seconds, peak memory", *shown],
                               [*chain, ["**together**", *(whole_cell(found, whole) for whole in shown)]])]
    for title, values, grown in GROWTH:
        powers = {stage: "{exponent:.2f} ({points})".format(**fitted)
                  for stage, fitted in found.get("growth", {}).get(title, {}).items()}
        rows = [[stage, *(cell(found.get(row, {}).get(stage)) for row in rows), powers.get(stage)]
                for stage, rows in grown.items() if stage in powers]
        if title == "frames":
            rows.append(["**together**", *(whole_cell(found, f"frames-{count}") for count in values), None])
        if powers:  # one value alone tells of no growth
            tables.append(figures.markdown([title, *map(str, values), "exponent (points)"], rows))
    return "\n\n".join(tables)


def whole_cell(found: dict, whole: str) -> str | None:
    """What a table says of a whole chain."""
    known = found.get("together", {}).get(whole)
    return known and f"**{known['minutes']:.1f} min, {known['peak_mb'] / 1000:.1f} GB**"


def cell(cost: dict | None) -> str | None:
    """What a table says of a stage: seconds, peak memory, and what disturbed the measurement."""
    if cost is None:
        return None
    if "over_s" in cost:
        return f"over {cost['over_s']:.0f} s"
    beside = (f" ({cost['processor_s']:.0f} s of processor; others took {cost['others']:.1f} cores)" if disturbed(cost)
              else "")
    return f"{cost['seconds']:.0f} s, {cost['peak_mb'] / 1000:.1f} GB{beside}"


def disturbed(cost: dict) -> bool:
    return (cost.get("others") or 0) > DISTURBED


if __name__ == "__main__":
    main()
