# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/growth.md in words and tables, out of what benchmarks/farm_model.py computed."""

from __future__ import annotations

import textwrap

from core.batch.groups import GATE

from . import figures

COMMAND = (
    "python -m benchmarks.farm_model --json docs/figures/farm_model.json --page docs/growth.md --capture "
    "CAPTURE --starts 5"
)
SLIMMED = "frames", "delit"
"""What `core slim` removes of a finished face."""
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


def bottleneck(record: dict) -> str:
    """What limits a farm, in words, by the smallest number of workers that something keeps up with."""
    limits, assumed = record["limits"], record["assumed"]
    slowest = sorted(record["stages"], key=record["stages"].get, reverse=True)[:2]
    share = sum(record["stages"][stage] for stage in slowest) / record["seconds"]
    workers, artist, storage, peak = assumed["workers"], limits["artist"], limits["storage"], limits["peak_gb"]
    return (
        f"With the artist's gate it is **the artist**: one who takes {assumed['gate_minutes']:g} minutes a mask "
        f"keeps up with {artist:.1f} workers, so "
        f"{workers} workers want {workers / artist:.0f} artists. Without it, it is **the processor** up to "
        f"{storage:.0f} workers ({slowest[0]} and "
        f"{slowest[1]} take {100 * share:.0f} % of a face's time); from there on **the shared storage**, which so "
        "many workers fill at "
        f"{assumed['storage_mb_s']:g} MB/s. Memory: a worker needs {peak:.1f} GB, {limits['gb_a_core']:.1f} GB a "
        "core; machines that have less leave cores "
        f"idle. Starting a task's command is {100 * limits['start_share']:.1f} % of a face's time."
    )


def page(record: dict) -> str:
    """docs/growth.md."""
    given = record["assumed"]
    grown = [
        [count, f"{cost['seconds']:.0f} s", f"{cost['processor_s']:.0f} s"] for count, cost in record["frames"].items()
    ]
    assumed = [[f"`--{name.replace('_', '-')}`", f"{value:g}", SAID[name]] for name, value in given.items()]
    parts = [
        f"<!-- Written by `{COMMAND}`: edit benchmarks/farm_page.py. -->\n# What {given['faces']:,} faces cost, on "
        "paper",
        wrapped(
            f"Measured: the sample's 60 frames at standard quality on {record['cores']} cores "
            f"({record['processor']}, networks in {record['networks']}), "
            "stage by stage (`docs/figures/costs.json`), and what a finished capture of it weighs. Assumed: all of "
            "the last table. Computed: the rest. "
            f"No farm and no GPU was at hand. `{COMMAND}` writes this page, with any argument of the last table; "
            "without `--capture` and `--starts` it "
            "takes what was measured before."
        ),
        "## Measured: one face",
        figures.markdown(["task", "time", "processor time", "peak memory", "reads", "writes"], _tasks(record)),
        wrapped(_measured(record)),
    ]
    if grown:
        parts += [
            "With other numbers of frames (the sample's, thinned out or played to and fro), and the other stages "
            "as they are:",
            figures.markdown(["frames", "time", "processor time"], grown),
        ]
    parts += [
        f"## Computed: {given['faces']:,} faces",
        figures.markdown(["what", "how much", "price"], _totals(record)),
        wrapped(_on_gpus(record)),
        "## The bottleneck",
        wrapped(bottleneck(record)),
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


def _tasks(record: dict) -> list[list[str]]:
    def cells(name: str, task: dict, mark: str) -> list[str]:
        texts = (
            name,
            f"{task['seconds']:.0f} s",
            f"{task['processor_s']:.0f} s",
            f"{task['peak_gb']:.1f} GB",
            f"{task['read_mb']:.0f} MB",
            f"{task['write_mb']:.0f} MB",
        )
        return [f"{mark}{text}{mark}" for text in texts]

    tasks = record["tasks"]
    whole = {
        key: sum(task[key] for task in tasks.values()) for key in ("seconds", "processor_s", "read_mb", "write_mb")
    }
    return [
        *(cells(name, task, "") for name, task in tasks.items()),
        cells("a face", {**whole, "peak_gb": record["limits"]["peak_gb"]}, "**"),
    ]


def _measured(record: dict) -> str:
    disk, command, torch = record["disk_mb"], record["starts"]["command"], record["starts"]["torch"]
    gone = sum(disk[name] for name in SLIMMED)
    return (
        f"A capture weighs {sum(disk.values()):.0f} MB: {disk['maps_4k']:.0f} MB of maps at 4K, "
        f"{disk['frames']:.0f} MB of frames, which grow with their "
        f"number. `core slim` takes {gone:.0f} MB off, for maps stay. What a task reads is counted once, its film "
        "with it: a second time the machine "
        f"may have it in memory. Before its first stage a task starts a command ({command['seconds']:.1f} s, "
        f"{command['processor_s']:.1f} s of processor) "
        f"and a worker that loads its libraries (PyTorch {torch['seconds']:.1f} s, {torch['processor_s']:.1f} s of "
        "processor: in the stages' times "
        "already)."
    )


def _totals(record: dict) -> list[list]:
    totals, given = record["totals"], record["assumed"]
    return [
        ["cores, reserved", f"{totals['core_hours']:,.0f} core hours", f"{totals['eur_cores']:,.0f} EUR"],
        ["of these at work", f"{totals['used_core_hours']:,.0f} core hours", None],
        ["disk, with the films", f"{totals['tb']:.1f} TB", f"{totals['eur_disk']:,.0f} EUR"],
        ["the same, slim", f"{totals['tb_slim']:.1f} TB", f"{totals['eur_disk_slim']:,.0f} EUR"],
        [
            "the artist's gate, where it is wanted",
            f"{totals['artist_hours']:,.0f} hours",
            f"{totals['eur_artist']:,.0f} EUR",
        ],
        [f"time, {given['workers']} workers of {record['cores']} cores", f"{totals['days']:.1f} days", None],
        [
            "cores, with the task solve on GPUs (assumed)",
            f"{totals['core_hours_beside_gpu']:,.0f} core hours, {totals['gpu_hours']:,.0f} GPU hours",
            f"{totals['eur_with_gpu']:,.0f} EUR",
        ],
    ]


def _on_gpus(record: dict) -> str:
    minutes, ours = record["assumed"]["gpu_solve_minutes"], record["tasks"][GATE]["seconds"] / 60
    return (
        f"GPU hours are an assumption: the {minutes:g} minutes that the paper reports for its own code on an RTX "
        "4090, "
        f"{'more' if minutes > ours else 'less'} than the {ours:.1f} minutes that our solver and upscaler take on "
        f"these {record['cores']} cores. Ours was "
        "not measured on a GPU, and needs none."
    )
