# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What many faces cost on a farm, on paper: docs/growth.md out of what was measured on one machine, and assumptions
that anyone can replace.

    python -m benchmarks.farm_model [--json docs/figures/farm_model.json] [--page docs/growth.md] [--capture CAPTURE]
                                    [--starts N] [--faces 10000] [--eur-core-hour 0.04] ...

Seconds, processor seconds and memory of each stage are those of docs/figures/costs.json (benchmarks/costs).
--capture weighs a finished capture of the same film: what each task writes and reads; --starts has N processes start as
a task does. Both are kept in the record and need no measuring again. Nothing here was run on a farm: docs/farm.md says
what was.
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path, PurePath

from core.batch.groups import GATE, GROUPS
from core.contract import stages
from core.contract.capture import Capture
from core.contract.files import replacing
from core.contract.messages import Problem

from . import figures
from .costs.meter import run_alone
from .farm_page import COMMAND, SAID, SLIMMED, page

PAGE = figures.ROOT / "docs" / "growth.md"
STARTS = {"command": (str(figures.ROOT), "--version"), "torch": ("-c", "import torch")}
"""What a task starts before its first stage: the command, and in the worker the largest library, which the stages'
seconds hold already."""


@dataclass(frozen=True)
class Assumptions:
    """What nobody measured here; each is an argument of the command."""

    faces: int = 10_000
    eur_core_hour: float = 0.04
    eur_gpu_hour: float = 0.60
    eur_gb_month: float = 0.02
    eur_artist_hour: float = 40.0
    months: float = 6.0
    repeats: float = 0.05
    gpu_solve_minutes: float = 8.0
    gate_minutes: float = 2.0
    film_mb: float = 60.0
    storage_mb_s: float = 500.0
    workers: int = 100


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--json", type=Path, help="keep the model's figures here; measurements that are there are used again"
    )
    parser.add_argument("--page", type=Path, help="write the page")
    parser.add_argument("--capture", type=Path, help="weigh this finished capture")
    parser.add_argument(
        "--starts",
        metavar="N",
        type=int,
        default=0,
        help="measure how long a task's processes take to start, N times each",
    )
    for field in fields(Assumptions):
        kind = type(field.default)
        parser.add_argument(
            f"--{field.name.replace('_', '-')}",
            type=kind,
            default=field.default,
            help=f"{SAID[field.name]} ({field.default:g})",
        )
    options = parser.parse_args()
    try:
        published = (figures.PUBLISHED / "farm_model.json").is_file()
        known = figures.read_record("farm_model")["figures"] if published else {}
        disk = weigh(Capture(options.capture)) if options.capture else known.get("disk_mb")
        starts = time_starts(options.starts) if options.starts else known.get("starts")
        if not disk or not starts:
            raise Problem(
                "Neither the disk of a face nor the start of a task was measured yet.",
                "Add --capture CAPTURE and --starts 5.",
            )
        given = Assumptions(**{field.name: getattr(options, field.name) for field in fields(Assumptions)})
        found = figures.plain(model_farm(figures.read_record("costs")["figures"], disk, starts, given))
    except Problem as problem:
        print(problem.problem, problem.remedy, sep="\n", file=sys.stderr)
        return 2
    if options.json:
        figures.write_record(options.json, "farm_model", COMMAND, found)
    text = page(found)
    if options.page:
        with replacing(options.page) as temporary:
            temporary.write_text(text, encoding="utf-8")
    else:
        print(text)
    return 0


def weigh(capture: Capture) -> dict[str, float]:
    """MB on the disk of each file or folder of a capture that a stage writes to, and of 'all else'. Raises Problem for
    a capture that is not finished."""
    names = dict.fromkeys(name for stage in stages.STAGES for name in stage.writes)
    missing = [name for name in names if not (capture.root / name).exists()]
    if missing:
        raise Problem(
            f"{capture.root} is not a finished capture: {missing[0]} is missing.", "Run the chain to its end first."
        )
    found = {entry: _megabytes(capture.root / entry) for entry in entries(names)}
    return {**found, "all else": round(_megabytes(capture.root) - sum(found.values()), 3)}


def entries(names: Iterable[str]) -> list[str]:
    """The capture's own files and folders in which these lie: a stage keeps more in its folder than others read."""
    return list(dict.fromkeys(PurePath(name).parts[0] for name in names))


def _megabytes(path: Path) -> float:
    files = [each for each in path.rglob("*") if each.is_file()] if path.is_dir() else [path]
    return round(sum(file.stat().st_size for file in files) / 1e6, 3)


def time_starts(count: int) -> dict[str, dict[str, float]]:
    """Median seconds and processor seconds of what a task starts."""
    found = {}
    for name, words in STARTS.items():
        ran = [run_alone(words).checked() for _ in range(count)]
        found[name] = {
            key: round(statistics.median(getattr(each, key) for each in ran), 2) for key in ("seconds", "processor_s")
        }
    return found


def model_farm(costs: dict, disk: dict[str, float], starts: dict, assumptions: Assumptions) -> dict:
    """Works out all figures of the page.

    Parameters
    ----------
    costs : what benchmarks/costs recorded
    disk : MB of each entry of a finished capture, as `weigh` finds them
    starts : what a task starts -> its median seconds, as `time_starts` finds them
    assumptions : what nobody measured

    Raises
    ------
    Problem
        Where the standard row of the costs is not whole.
    """
    row, cores = costs.get("standard", {}), costs["machine"]["cores"]
    if any("seconds" not in row.get(stage, {}) for stage in stages.NAMES):
        raise Problem(
            "docs/figures/costs.json has no whole row 'standard'.",
            "Run `python -m benchmarks.costs chain WORK --json docs/figures/costs.json`.",
        )
    tasks = {group.name: _task(group, row, disk, assumptions.film_mb) for group in GROUPS}
    seconds, traffic = (sum(task[key] for task in tasks.values()) for key in ("seconds", "traffic_mb"))
    solve, faces, hour = tasks[GATE]["seconds"], assumptions.faces, 3600.0
    kept = (sum(disk.values()) + assumptions.film_mb) / 1000
    slim = kept - sum(disk[name] for name in SLIMMED) / 1000
    more = faces * (1 + assumptions.repeats) / hour  # hours of all faces for a second of one
    core_hours, gpu_hours = seconds * cores * more, assumptions.gpu_solve_minutes * 60 * more
    totals = {
        "used_core_hours": sum(task["processor_s"] for task in tasks.values()) * more,
        "core_hours": core_hours,
        "eur_cores": core_hours * assumptions.eur_core_hour,
        "gpu_hours": gpu_hours,
        "core_hours_beside_gpu": (seconds - solve) * cores * more,
        "eur_with_gpu": gpu_hours * assumptions.eur_gpu_hour
        + (seconds - solve) * cores * more * assumptions.eur_core_hour,
        "tb": faces * kept / 1000,
        "tb_slim": faces * slim / 1000,
        "eur_disk": faces * kept * assumptions.months * assumptions.eur_gb_month,
        "eur_disk_slim": faces * slim * assumptions.months * assumptions.eur_gb_month,
        "artist_hours": faces * assumptions.gate_minutes / 60,
        "eur_artist": faces * assumptions.gate_minutes / 60 * assumptions.eur_artist_hour,
        "days": core_hours / cores / assumptions.workers / 24,
    }
    start = starts["command"]["seconds"] * len(GROUPS)
    limits = {
        "artist": seconds / (assumptions.gate_minutes * 60),
        "storage": assumptions.storage_mb_s * seconds / traffic,
        "start_share": start / (seconds + start),
        "peak_gb": max(task["peak_gb"] for task in tasks.values()),
        "gb_a_core": max(task["peak_gb"] for task in tasks.values()) / cores,
    }
    return {
        "cores": cores,
        "processor": costs["machine"]["processor"],
        "networks": costs["machine"]["networks"],
        "frames": _frames(costs, row),
        "stages": {stage: row[stage]["seconds"] for stage in stages.NAMES},
        "tasks": tasks,
        "seconds": seconds,
        "traffic_mb": traffic,
        "gb": kept,
        "gb_slim": slim,
        "totals": totals,
        "limits": limits,
        "starts": starts,
        "disk_mb": disk,
        "assumed": asdict(assumptions),
    }


def _task(group, row: dict, disk: dict[str, float], film_mb: float) -> dict[str, float]:
    """Cost of one task of a face. It reads what its own stages and all before them read, once: what is there already is
    compared with what it was made from."""
    upto = stages.STAGES[: stages.NAMES.index(group.last) + 1]
    written = entries(name for stage in group.stages for name in stage.writes)
    read = set(entries(name for stage in upto for name in (*stage.reads, *stage.optional_reads))) - set(written)
    reads, writes = sum(disk.get(name, 0.0) for name in read) + film_mb, sum(disk[name] for name in written)
    return {
        "seconds": sum(row[stage.name]["seconds"] for stage in group.stages),
        "processor_s": sum(row[stage.name]["processor_s"] for stage in group.stages),
        "peak_gb": max(row[stage.name]["peak_mb"] for stage in group.stages) / 1000,
        "read_mb": reads,
        "write_mb": writes,
        "traffic_mb": reads + writes,
    }


def _frames(costs: dict, row: dict) -> dict[str, dict]:
    """What a face takes by how many frames are used: wherever the stages that see every frame were measured with
    another number of them."""
    found = {}
    for name, cost in costs.items():
        count = re.fullmatch(r"frames-(\d+)", name)
        if count and all("seconds" in cost.get(stage, {}) for stage in ("frames", "cameras", "scan")):
            mixed = {**row, **cost}
            found[count[1]] = {
                key: sum(mixed[stage][key] for stage in stages.NAMES) for key in ("seconds", "processor_s")
            }
    return dict(sorted(found.items(), key=lambda each: int(each[0])))


if __name__ == "__main__":
    sys.exit(main())
