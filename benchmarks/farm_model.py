# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What many faces cost on a farm, on paper: docs/growth.md out of what was measured on one machine, and assumptions
that anyone can replace.

    python -m benchmarks.farm_model [--json docs/figures/farm_model.json] [--page docs/growth.md] [--capture CAPTURE]
                                    [--starts N] [--faces 10000] [--eur-core-hour 0.04] ...

Seconds, processor seconds and memory of each stage are those of docs/figures/costs.json (benchmarks/costs.py).
--capture weighs a finished capture of the same film: what each task writes and reads; --starts has N processes start as
a task does. Both are kept in the record and need no measuring again. Nothing here was run on a farm: docs/farm.md says
what was.
"""

from __future__ import annotations

import argparse
import re
import statistics
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path, PurePath

from core.batch.groups import GATE, GROUPS
from core.contract import stages
from core.contract.capture import Capture
from core.contract.files import replacing
from core.contract.messages import Problem

from . import figures
from .stage_cost import own_s

PAGE = figures.ROOT / "docs" / "growth.md"
COMMAND = ("python -m benchmarks.farm_model --json docs/figures/farm_model.json --page docs/growth.md --capture "
           "CAPTURE --starts 5")
SLIMMED = tuple(name.rstrip("/") for name in stages.SLIMMED)
"""What `core slim` removes of a finished face."""
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


SAID = {
    "faces": "how many",
    "eur_core_hour": "EUR for a core for an hour, with its memory, as clouds and farms charge in that order of size",
    "eur_gpu_hour": "EUR for an hour of a GPU like an RTX 4090",
    "eur_gb_month": "EUR to keep a GB for a month",
    "eur_artist_hour": "EUR for an hour of an artist, who looks at masks",
    "months": "months for which a face is kept",
    "repeats": "share of the work that is done twice, because machines fail or are taken away",
    "gpu_solve_minutes": "minutes of a GPU for the task solve: those which the paper reports for its own solver and "
                         "upscaler on an RTX 4090 (section 4.4); "
                         "ours was not measured on a GPU",
    "gate_minutes": "minutes for which an artist looks at a mask, or paints on it",
    "film_mb": "MB of a phone's film of 30 seconds",
    "storage_mb_s": "MB a second that the shared storage gives to all machines together",
    "workers": "workers at a time, each with as many cores as the machine of the measurement",
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path,
                        help="keep the model's figures here; measurements that are there are used again")
    parser.add_argument("--page", type=Path, help="write the page")
    parser.add_argument("--capture", type=Path, help="weigh this finished capture")
    parser.add_argument("--starts", metavar="N", type=int, default=0,
                        help="measure how long a task's processes take to start, N times each")
    for field in fields(Assumptions):
        kind = type(field.default)
        parser.add_argument(f"--{field.name.replace('_', '-')}", type=kind, default=field.default,
                            help=f"{SAID[field.name]} ({field.default:g})")
    options = parser.parse_args()
    try:
        known = figures.read("farm_model")["figures"] if (figures.PUBLISHED / "farm_model.json").is_file() else {}
        disk = weigh(Capture(options.capture)) if options.capture else known.get("disk_mb")
        starts = time_starts(options.starts) if options.starts else known.get("starts")
        if not disk or not starts:
            raise Problem("Neither the disk of a face nor the start of a task was measured yet.",
                          "Add --capture CAPTURE and --starts 5.")
        given = Assumptions(**{field.name: getattr(options, field.name) for field in fields(Assumptions)})
        found = figures.plain(model(figures.read("costs")["figures"], disk, starts, given))
    except Problem as problem:
        print(problem.problem, problem.remedy, sep="\n", file=sys.stderr)
        return 2
    if options.json:
        figures.write(options.json, "farm_model", COMMAND, found)
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
        raise Problem(f"{capture.root} is not a finished capture: {missing[0]} is missing.",
                      "Run the chain to its end first.")
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
        walls, used = [], []
        for _ in range(count):
            own, began = own_s()[1], time.monotonic()
            subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
            walls.append(time.monotonic() - began)
            used.append(own_s()[1] - own)
        found[name] = {"seconds": round(statistics.median(walls), 2), "processor_s": round(statistics.median(used), 2)}
    return found


def model(costs: dict, disk: dict[str, float], starts: dict, given: Assumptions) -> dict:
    """All figures of the page. `costs` is what benchmarks/costs.py recorded. Raises Problem where its standard row is
    not whole."""
    row, cores = costs.get("standard", {}), costs["machine"]["cores"]
    if any("seconds" not in row.get(stage, {}) for stage in stages.NAMES):
        raise Problem("docs/figures/costs.json has no whole row 'standard'.",
                      "Run `python -m benchmarks.costs WORK --json docs/figures/costs.json`.")
    tasks = {group.name: _task(group, row, disk, given.film_mb) for group in GROUPS}
    seconds, traffic = (sum(task[key] for task in tasks.values()) for key in ("seconds", "traffic_mb"))
    solve, faces, hour = tasks[GATE]["seconds"], given.faces, 3600.0
    kept = (sum(disk.values()) + given.film_mb) / 1000
    slim = kept - sum(disk[name] for name in SLIMMED) / 1000
    more = faces * (1 + given.repeats) / hour  # hours of all faces for a second of one
    core_hours, gpu_hours = seconds * cores * more, given.gpu_solve_minutes * 60 * more
    totals = {
        "used_core_hours": sum(task["processor_s"] for task in tasks.values()) * more, "core_hours": core_hours,
        "eur_cores": core_hours * given.eur_core_hour,
        "gpu_hours": gpu_hours, "core_hours_beside_gpu": (seconds - solve) * cores * more,
        "eur_with_gpu": gpu_hours * given.eur_gpu_hour + (seconds - solve) * cores * more * given.eur_core_hour,
        "tb": faces * kept / 1000, "tb_slim": faces * slim / 1000,
        "eur_disk": faces * kept * given.months * given.eur_gb_month,
        "eur_disk_slim": faces * slim * given.months * given.eur_gb_month,
        "artist_hours": faces * given.gate_minutes / 60,
        "eur_artist": faces * given.gate_minutes / 60 * given.eur_artist_hour,
        "days": core_hours / cores / given.workers / 24,
    }
    start = starts["command"]["seconds"] * len(GROUPS)
    limits = {"artist": seconds / (given.gate_minutes * 60), "storage": given.storage_mb_s * seconds / traffic,
              "start_share": start / (seconds + start),
              "peak_gb": max(task["peak_gb"] for task in tasks.values()),
              "gb_a_core": max(task["peak_gb"] for task in tasks.values()) / cores}
    return {"cores": cores, "processor": costs["machine"]["processor"], "networks": costs["machine"]["networks"],
            "frames": _frames(costs, row), "stages": {
        stage: row[stage]["seconds"] for stage in stages.NAMES}, "tasks": tasks, "seconds": seconds,
            "traffic_mb": traffic, "gb": kept, "gb_slim": slim,
        "totals": totals, "limits": limits, "starts": starts, "disk_mb": disk, "assumed": asdict(given)}


def _task(group, row: dict, disk: dict[str, float], film_mb: float) -> dict[str, float]:
    """Cost of one task of a face. It reads what its own stages and all before them read, once: what is there already is
    compared with what it was made from."""
    upto = stages.STAGES[:stages.NAMES.index(group.last) + 1]
    written = entries(name for stage in group.stages for name in stage.writes)
    read = set(entries(name for stage in upto for name in (*stage.reads, *stage.optional_reads))) - set(written)
    reads, writes = sum(disk.get(name, 0.0) for name in read) + film_mb, sum(disk[name] for name in written)
    return {"seconds": sum(row[stage.name]["seconds"] for stage in group.stages),
            "processor_s": sum(row[stage.name]["processor_s"] for stage in group.stages),
            "peak_gb": max(row[stage.name]["peak_mb"] for stage in group.stages) / 1000, "read_mb": reads,
            "write_mb": writes, "traffic_mb": reads + writes}


def _frames(costs: dict, row: dict) -> dict[str, dict]:
    """What a face takes by how many frames are used: wherever the stages that see every frame were measured with
    another number of them."""
    found = {}
    for name, cost in costs.items():
        count = re.fullmatch(r"frames-(\d+)", name)
        if count and all("seconds" in cost.get(stage, {}) for stage in ("frames", "cameras", "scan")):
            mixed = {**row, **cost}
            found[count[1]] = {key: sum(mixed[stage][key] for stage in stages.NAMES)
                               for key in ("seconds", "processor_s")}
    return dict(sorted(found.items(), key=lambda each: int(each[0])))


def bottleneck(found: dict) -> str:
    """What limits a farm, in words, by the smallest number of workers that something keeps up with."""
    limits, assumed = found["limits"], found["assumed"]
    slowest = sorted(found["stages"], key=found["stages"].get, reverse=True)[:2]
    share = sum(found["stages"][stage] for stage in slowest) / found["seconds"]
    workers, artist, storage, peak = assumed["workers"], limits["artist"], limits["storage"], limits["peak_gb"]
    return (f"With the artist's gate it is **the artist**: one who takes {assumed['gate_minutes']:g} minutes a mask "
            f"keeps up with {artist:.1f} workers, so "
            f"{workers} workers want {workers / artist:.0f} artists. Without it, it is **the processor** up to "
            f"{storage:.0f} workers ({slowest[0]} and "
            f"{slowest[1]} take {100 * share:.0f} % of a face's time); from there on **the shared storage**, which so "
            "many workers fill at "
            f"{assumed['storage_mb_s']:g} MB/s. Memory: a worker needs {peak:.1f} GB, {limits['gb_a_core']:.1f} GB a "
            "core; machines that have less leave cores "
            f"idle. Starting a task's command is {100 * limits['start_share']:.1f} % of a face's time.")


def page(found: dict) -> str:
    """docs/growth.md."""
    given = found["assumed"]
    grown = [[count, f"{cost['seconds']:.0f} s", f"{cost['processor_s']:.0f} s"]
             for count, cost in found["frames"].items()]
    assumed = [[f"`--{name.replace('_', '-')}`", f"{value:g}", SAID[name]] for name, value in given.items()]
    parts = [
        f"<!-- Written by `{COMMAND}`: edit benchmarks/farm_model.py. -->\n# What {given['faces']:,} faces cost, on "
        "paper",
        wrapped(f"Measured: the sample's 60 frames at standard quality on {found['cores']} cores "
                f"({found['processor']}, networks in {found['networks']}), "
                "stage by stage (`docs/figures/costs.json`), and what a finished capture of it weighs. Assumed: all of "
                "the last table. Computed: the rest. "
                f"No farm and no GPU was at hand. `{COMMAND}` writes this page, with any argument of the last table; "
                "without `--capture` and `--starts` it "
                "takes what was measured before."),
        "## Measured: one face",
        figures.markdown(["task", "time", "processor time", "peak memory", "reads", "writes"], _tasks(found)),
        wrapped(_measured(found))]
    if grown:
        parts += ["With other numbers of frames (the sample's, thinned out or played to and fro), and the other stages "
                  "as they are:",
                  figures.markdown(["frames", "time", "processor time"], grown)]
    parts += [
        f"## Computed: {given['faces']:,} faces",
        figures.markdown(["what", "how much", "price"], _totals(found)),
        wrapped(_on_gpus(found)),
        "## The bottleneck",
        wrapped(bottleneck(found)),
        "## The formulas",
        "Faces know nothing of each other, so everything is linear in their number F:",
        FORMULAS,
        wrapped(
            "Per face, Frames, Cameras and Scan grow with the frames; Delight and Texture with the views that are "
            "selected of them (16 of any number); "
            "Solve and 4K Maps with the side of the maps. [Costs](results/costs.md) has what was measured of each."
        ),
        "## Assumed",
        figures.markdown(["argument", "value", "what it is"], assumed),
    ]
    return "\n\n".join(parts) + "\n"


def wrapped(text: str) -> str:
    """A paragraph in lines as the other pages have them."""
    return textwrap.fill(text, 158, break_long_words=False, break_on_hyphens=False)


FORMULAS = """    core hours = F x (1 + repeats) x seconds of a face x cores of a worker / 3600
    EUR        = core hours x EUR a core hour + F x GB of a face x months x EUR a GB month
    days       = core hours / cores of a worker / workers / 24
    one artist keeps up with   seconds of a face / (60 x minutes at the gate)           workers
    the storage keeps up with  MB/s x seconds of a face / MB that it reads and writes   workers"""


def _tasks(found: dict) -> list[list[str]]:
    def cells(name: str, task: dict, mark: str) -> list[str]:
        texts = (name, f"{task['seconds']:.0f} s", f"{task['processor_s']:.0f} s", f"{task['peak_gb']:.1f} GB",
                 f"{task['read_mb']:.0f} MB", f"{task['write_mb']:.0f} MB")
        return [f"{mark}{text}{mark}" for text in texts]

    tasks = found["tasks"]
    whole = {key: sum(task[key] for task in tasks.values())
             for key in ("seconds", "processor_s", "read_mb", "write_mb")}
    return [*(cells(name, task, "") for name, task in tasks.items()),
            cells("a face", {**whole, "peak_gb": found["limits"]["peak_gb"]}, "**")]


def _measured(found: dict) -> str:
    disk, command, torch = found["disk_mb"], found["starts"]["command"], found["starts"]["torch"]
    gone = sum(disk[name] for name in SLIMMED)
    return (f"A capture weighs {sum(disk.values()):.0f} MB: {disk['maps_4k']:.0f} MB of maps at 4K, "
            f"{disk['frames']:.0f} MB of frames, which grow with their "
            f"number. `core slim` takes {gone:.0f} MB off, for maps stay. What a task reads is counted once, its film "
            "with it: a second time the machine "
            f"may have it in memory. Before its first stage a task starts a command ({command['seconds']:.1f} s, "
            f"{command['processor_s']:.1f} s of processor) "
            f"and a worker that loads its libraries (PyTorch {torch['seconds']:.1f} s, {torch['processor_s']:.1f} s of "
            "processor: in the stages' times "
            "already).")


def _totals(found: dict) -> list[list]:
    totals, given = found["totals"], found["assumed"]
    return [
        ["cores, reserved", f"{totals['core_hours']:,.0f} core hours", f"{totals['eur_cores']:,.0f} EUR"],
        ["of these at work", f"{totals['used_core_hours']:,.0f} core hours", None],
        ["disk, with the films", f"{totals['tb']:.1f} TB", f"{totals['eur_disk']:,.0f} EUR"],
        ["the same, slim", f"{totals['tb_slim']:.1f} TB", f"{totals['eur_disk_slim']:,.0f} EUR"],
        ["the artist's gate, where it is wanted", f"{totals['artist_hours']:,.0f} hours",
         f"{totals['eur_artist']:,.0f} EUR"],
        [f"time, {given['workers']} workers of {found['cores']} cores", f"{totals['days']:.1f} days", None],
        ["cores, with the task solve on GPUs (assumed)",
         f"{totals['core_hours_beside_gpu']:,.0f} core hours, {totals['gpu_hours']:,.0f} GPU hours",
         f"{totals['eur_with_gpu']:,.0f} EUR"]]


def _on_gpus(found: dict) -> str:
    minutes, ours = found["assumed"]["gpu_solve_minutes"], found["tasks"][GATE]["seconds"] / 60
    return (f"GPU hours are an assumption: the {minutes:g} minutes that the paper reports for its own code on an RTX "
            "4090, "
            f"{'more' if minutes > ours else 'less'} than the {ours:.1f} minutes that our solver and upscaler take on "
            f"these {found['cores']} cores. Ours was "
            "not measured on a GPU, and needs none.")


if __name__ == "__main__":
    sys.exit(main())
