# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of the whole chain, stage by stage.

    python -m research.benchmarks.costs WORK [--rows standard draft frames-300] [--film VIDEO] --json
    research/records/costs.json

Each stage is a `python -m core run` of its own. "standard" goes from the sample video to the delivery; "draft" starts
from a copy of its cameras; "frames-300" is the whole chain on 300 frames of --film.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from core.capture import stages

from . import figures

VIDEO = figures.ROOT / "research" / "people" / "sample" / "capture.mp4"
ROWS = ("standard", "draft", "frames-300")
BEFORE_DRAFT = ("frames", "cameras")
"""Stages whose settings a draft shares with the standard quality."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS[:2]))
    parser.add_argument("--film", type=Path, help="a video of 300 frames or more")
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    if "frames-300" in options.rows and options.film is None:
        parser.error("the row frames-300 needs --film")
    for row in options.rows:
        costs = measure_row(row, options.work / f"{row}.wildcap", options.film)
        figures.write_record(
            options.json,
            "costs",
            "python -m research.benchmarks.costs WORK --json OUT.json",
            {row: {**costs, "together": sum_costs(costs)}},
            keep=True,
        )
    print(table(figures.read_record(options.json.stem, options.json.parent)["figures"]))


def measure_row(row: str, capture: Path, film: Path | None) -> dict[str, dict]:
    """Measure each stage of a row of ROWS. Raises SystemExit where one fails."""
    shutil.rmtree(capture, ignore_errors=True)
    source, options, names = VIDEO, [], stages.NAMES
    if row == "draft":
        standard = capture.with_name("standard.wildcap")
        shutil.copytree(standard, capture, ignore=shutil.ignore_patterns("maps*", "checkpoints"))
        options, names = ["--quality", "draft"], tuple(name for name in names if name not in BEFORE_DRAFT)
    elif film is not None and row == "frames-300":
        source, options = film, ["--set", "frames.max_frames=300"]
    costs = {}
    for stage in names:
        costs[stage] = measure_stage(capture, stage, source, options)
        if "problem" in costs[stage]:
            sys.exit(costs[stage]["problem"])
        print(f"{row}: {stage}: {cell(costs[stage])}", flush=True)
    return costs


def measure_stage(capture: Path, stage: str, source: Path, options: list[str] | None = None) -> dict:
    """Run one stage, even if it is fresh, and measure its process and those that it starts.

    Returns {"seconds", "processor_s", "peak_mb"}, peak_mb being that of the largest process (Linux, macOS), or
    {"problem"} with what was printed if the stage failed.
    """
    words = ["run", str(source), str(capture), "--from", stage, "--until", stage, *(options or ())]
    began = time.monotonic()
    child = subprocess.Popen(
        [sys.executable, "-m", "core", *words],
        cwd=figures.ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    errors = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        return {"problem": errors.strip()[-1000:]}
    unit = 1 if sys.platform == "darwin" else 1024
    return {
        "seconds": round(time.monotonic() - began, 1),
        "processor_s": round(usage.ru_utime + usage.ru_stime, 1),
        "peak_mb": round(usage.ru_maxrss * unit / 2**20),
    }


def sum_costs(costs: dict[str, dict]) -> dict:
    return {
        "minutes": round(sum(cost["seconds"] for cost in costs.values()) / 60, 1),
        "peak_mb": max(cost["peak_mb"] for cost in costs.values()),
    }


def table(rows: dict) -> str:
    """Markdown: a line for each stage, a column for each row; a stage that a draft shares shows the standard cost."""
    names = [row for row in ROWS if row in rows]
    lines = [
        [stage, *(cell(rows[row].get(stage) or rows["standard"][stage]) for row in names)] for stage in stages.NAMES
    ]
    total = ["**together**", *(f"**{rows[row]['together']['minutes']:.1f} min**" for row in names)]
    return figures.markdown(["stage: seconds, peak memory", *names], [*lines, total])


def cell(cost: dict) -> str:
    return f"{cost['seconds']:.0f} s, {cost['peak_mb'] / 1000:.1f} GB"


if __name__ == "__main__":
    main()
