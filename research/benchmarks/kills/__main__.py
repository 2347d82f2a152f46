# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kill workers, the add-on and COLMAP at random moments over the real stages, and judge what is left.

    python -m research.benchmarks.kills [--count 200] [--seed 0] [--only K] [--json research/records/kills.json]

A trial begins with a copy of a small capture (eight frames of the sample video, their true cameras) at a random stage,
which was not run yet or was run with other settings, and with the user's files everywhere. Afterwards these must be
there, painted masks be the old or a new one, and each file under its final name be complete; the next run must end with
the bytes of an undisturbed one, leave nothing else in the capture or outside of it, and free the lock. Exit code 0 only
if all of that held. Linux; where mounts of its own are allowed, full disks are disks of their own in memory.
"""

import argparse
import os
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

from core.capture.stages import NAMES
from core.worker.client import THREAD_VARIABLES

from .. import figures
from . import capture, disk, worker
from .trials import KINDS, KillTrial

SPACE = 6 << 30
BLENDERS_OWN = "blender_"
"""Beginning of the name of the folder that a killed Blender leaves in the system's temporary one."""


def main() -> int:
    parser = figures.command_line(__doc__, "kills")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="K", help="trial number K alone, as of a fault")
    parser.add_argument("--until", choices=NAMES, default=NAMES[-1], help="the last stage that is tried")
    parser.add_argument("--delighter", default="network")
    options = parser.parse_args()
    began = time.monotonic()
    work = Path(tempfile.mkdtemp(prefix="wildcap_kills_"))
    private = disk.go_private()  # before any library starts a thread
    try:
        if private:
            disk.mount(work, SPACE)
        trials = run_trials(options, work, private)
    finally:
        disk.unmount(work)
        shutil.rmtree(work, ignore_errors=True)
    return report(trials, options, private, time.monotonic() - began)


def run_trials(options: argparse.Namespace, work: Path, private: bool) -> list[KillTrial]:
    """Run all trials, each in a place of its own in `work`."""
    watched = work / "temporary", work / "home"
    for folder in watched:
        folder.mkdir()
    os.environ |= dict.fromkeys(THREAD_VARIABLES, "1")
    os.environ |= {"TMPDIR": str(watched[0]), "HOME": str(watched[1]), "BLENDER_USER_RESOURCES": str(work / "blender")}
    tempfile.tempdir = None
    worker.warm_up()
    print(f"Undisturbed, {'on a disk of its own in memory' if private else 'on the disk of ' + str(work)}:", flush=True)
    undisturbed = capture.run_undisturbed(work / "undisturbed", options.until, options.delighter)
    (work / "trials").mkdir()
    trials = []
    for number, kind in enumerate(draw_kinds(options)):
        if options.only not in (None, number):
            continue
        rng, place = random.Random(f"{options.seed} {number}"), work / "trials" / str(number)
        trial, began = KillTrial(number, kind, rng, undisturbed, place, private), time.monotonic()
        KINDS[kind].run(trial)
        trial.faults += [f"{path.relative_to(work)} lies outside the capture" for path in clear(watched)]
        verdict = "fault" if trial.faults else "ok"
        print(f"{number:4} {kind:8} {verdict:6}{time.monotonic() - began:5.1f} s  {trial.where}", flush=True)
        for fault in trial.faults:
            print(f"     {fault}", flush=True)
        disk.unmount(place)
        for left in work.glob(f"trials/{number}*"):
            shutil.rmtree(left) if left.is_dir() else left.unlink()
        trials.append(trial)
    return trials


def draw_kinds(options: argparse.Namespace) -> list[str]:
    """Draw the kinds of all trials in rounds, each in an order of its own; the same seed gives the same."""
    last = NAMES.index(options.until)
    once = [name for name, kind in KINDS.items() if NAMES.index(kind.needs) <= last for _ in range(kind.weight)]
    rng, drawn = random.Random(options.seed), []
    while len(drawn) < options.count:
        drawn += rng.sample(once, len(once))
    return drawn[: options.count]


def clear(watched: tuple[Path, Path]) -> list[Path]:
    """Remove what lies in the watched folders, and return it, without what Blender makes when it starts."""
    found = []
    for path in (path for folder in watched for path in folder.iterdir()):
        empty = not any(inside.is_file() for inside in path.rglob("*"))
        if not (path.name.startswith(BLENDERS_OWN) or path.name == ".cache" and empty):
            found.append(path)
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return found


def report(trials: list[KillTrial], options: argparse.Namespace, private: bool, seconds: float) -> int:
    """Print and record the counts of each kind; the exit code."""
    rows = {}
    for name in (*KINDS, "all"):
        chosen = [trial for trial in trials if name in (trial.kind, "all")]
        if chosen or name == "all":
            faultless = sum(not trial.faults for trial in chosen)
            rows[name] = {"trials": len(chosen), "struck": sum(t.struck for t in chosen), "faultless": faultless}
    print(f"\n{'':10}{'trials':>8}{'struck':>8}{'faultless':>11}")
    for name, row in rows.items():
        print(f"{name:10}{row['trials']:8}{row['struck']:8}{row['faultless']:11}")
    for trial in (trial for trial in trials if trial.faults):
        words = f"--count {options.count} --seed {options.seed} --only {trial.number}"
        print(f"Again: python -m research.benchmarks.kills {words}  # {trial.kind}: {trial.faults[0]}")
    print(f"\n{len(trials)} trials in {seconds / 60:.1f} minutes.")
    figures.write_record(
        options.json,
        "kills",
        "python -m research.benchmarks.kills --count COUNT --seed SEED",
        {"rows": rows, "seed": options.seed, "minutes": seconds / 60, "own_disks": private},
    )
    return 0 if trials and rows["all"]["faultless"] == len(trials) else 1


if __name__ == "__main__":
    sys.exit(main())
