# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of the whole chain, stage by stage.

    python -m research.benchmarks.costs WORK --json research/records/costs.json

Each stage is run by a worker of its own. WORK is a new folder, which gets two captures of the sample video: one
of the standard quality, from the video to the delivery, and a draft, which goes on from a copy of its cameras.
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
from core.capture.capture import Capture
from core.capture.messages import Done, from_line
from core.worker.job import write_job

from . import figures

VIDEO = figures.ROOT / "research" / "people" / "sample" / "capture.mp4"
SHARED = ("frames", "cameras")
"""Stages whose settings a draft shares with the standard quality."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args()
    if options.work.exists():
        parser.error(f"{options.work} exists: name a new folder.")
    standard, draft = (options.work / f"{quality}.wildcap" for quality in ("standard", "draft"))
    rows = {"standard": measure_stages(standard, stages.ALWAYS, "standard")}
    shutil.copytree(standard, draft, ignore=shutil.ignore_patterns("maps*", "checkpoints"))
    rest = tuple(name for name in stages.ALWAYS if name not in SHARED)
    rows["draft"] = {**{name: rows["standard"][name] for name in SHARED}, **measure_stages(draft, rest, "draft")}
    record = {quality: {**costs, "together": sum_costs(costs)} for quality, costs in rows.items()}
    command = "python -m research.benchmarks.costs WORK --json research/records/costs.json"
    figures.write_record(options.json, "costs", command, record)
    print(table(record))


def measure_stages(capture: Path, names: tuple[str, ...], quality: str) -> dict[str, dict]:
    """Measure these stages in order. Raises SystemExit with the problem of one that fails."""
    costs = {}
    for name in names:
        costs[name] = measure_stage(capture, name, VIDEO, quality)
        if "problem" in costs[name]:
            raise SystemExit(costs[name]["problem"])
        print(f"{quality}: {name}: {cell(costs[name])}", flush=True)
    return costs


def measure_stage(
    capture: Path, stage: str, source: Path, quality: str = "standard", settings: dict | None = None
) -> dict:
    """Run one stage in a worker, even if it is fresh, and measure the worker and the processes that it starts.

    Returns {"seconds", "processor_s", "peak_mb"}, peak_mb being that of the largest process (Linux, macOS), or
    {"problem", "remedy"} if the stage failed.
    """
    face = Capture(capture)
    face.claim()
    job = write_job(face, source=source, first=stage, last=stage, settings=settings, quality=quality)
    began = time.monotonic()
    worker = subprocess.Popen(
        [sys.executable, "-m", "core.worker", str(job)],
        cwd=figures.ROOT,
        stdin=subprocess.PIPE,  # its end would end the worker
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    last = from_line(worker.stdout.read().splitlines()[-1])
    _, _, usage = os.wait4(worker.pid, 0)
    if not isinstance(last, Done):
        return {"problem": last.problem, "remedy": last.remedy}
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
    """Lay out the costs as Markdown: a line for each stage, a column for each quality."""
    lines = [[name, *(cell(costs[name]) for costs in rows.values())] for name in stages.ALWAYS]
    total = ["**together**", *(f"**{costs['together']['minutes']:.1f} min**" for costs in rows.values())]
    return figures.markdown(["stage: seconds, peak memory", *rows], [*lines, total])


def cell(cost: dict) -> str:
    return f"{cost['seconds']:.0f} s, {cost['peak_mb'] / 1000:.1f} GB"


if __name__ == "__main__":
    main()
