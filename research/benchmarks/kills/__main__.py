# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kill workers, the add-on and COLMAP at random moments over the real stages, and looks at what is left and at what
the next run makes of it.

    python -m research.benchmarks.kills [--count 200] [--seed 0] [--only K] [--json research/records/kills.json]

A trial begins with a copy of a small capture (eight frames of the sample video, their true cameras) at a random stage,
that had not been run or had been run with other settings, and with files of the user's everywhere. Afterwards those
have to be there, painted masks be the old or a new one, and each file under its final name a complete one; the next run
has to end with the bytes of an undisturbed one, with nothing left in the capture or outside of it and the lock free.
Exit code 0 only where all that held. Linux; where mounts of its own are allowed, full disks are disks of their own in
memory.
"""

from __future__ import annotations

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

from . import disk

MIX = {
    "moment": 12,
    "write": 12,
    "command": 2,
    "mask": 6,
    "deliver": 6,
    "full": 4,
    "asleep": 4,
    "at_once": 2,
    "colmap": 4,
}
"""Kinds of trial, and how many of each there are in a round."""
NEEDS = {"deliver": NAMES[-1], "colmap": "cameras"}
"""Stages up to which the chain has to have been run for a kind."""
SPACE = 6 << 30
BLENDERS_OWN = "blender_"
"""Begins the name of the folder that a killed Blender leaves in the system's temporary one."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="K", help="trial number K alone, as of a fault")
    parser.add_argument("--until", choices=NAMES, default=NAMES[-1], help="the last stage that is tried")
    parser.add_argument("--delighter", default="network")
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/kills.json")
    arguments = parser.parse_args()
    began = time.monotonic()
    work = Path(tempfile.mkdtemp(prefix="wildcap_kills_"))
    private = disk.go_private()
    try:
        if private:
            disk.mount(work, SPACE)
        watched = _watch(work)
        return _run(arguments, work, watched, private, began)
    finally:
        disk.unmount(work)
        shutil.rmtree(work, ignore_errors=True)


def _watch(work: Path) -> tuple[Path, Path]:
    """An empty folder each as the system's temporary one and as the user's own, for all that is started from here."""
    folders = work / "temporary", work / "home"
    for folder in folders:
        folder.mkdir()
    os.environ |= {
        "TMPDIR": str(folders[0]),
        "HOME": str(folders[1]),
        **dict.fromkeys(THREAD_VARIABLES, "1"),
        "BLENDER_USER_RESOURCES": str(work / "blender"),
    }
    tempfile.tempdir = None
    return folders


def _run(arguments: argparse.Namespace, work: Path, watched: tuple[Path, Path], private: bool, began: float) -> int:
    # numerical libraries ask for the number of threads when they are loaded
    from .. import figures
    from . import capture, others, trials, worker

    worker.warm_up()
    print(f"Undisturbed, {'on a disk of its own in memory' if private else 'on the disk of ' + str(work)}:", flush=True)
    undisturbed = capture.run_undisturbed(work / "undisturbed", arguments.until, arguments.delighter)
    kinds = {
        "moment": lambda trial: trials.killed(trial, writing=False),
        "write": lambda trial: trials.killed(trial, writing=True),
        "command": trials.command,
        "mask": others.saving,
        "deliver": others.delivering,
        "full": trials.full,
        "asleep": trials.asleep,
        "at_once": trials.at_once,
        "colmap": others.colmap,
    }
    found: dict[str, list] = {}
    for number, kind in enumerate(_draw(arguments)):
        if arguments.only not in (None, number):
            continue
        place = work / "trials" / str(number)
        place.parent.mkdir(exist_ok=True)
        trial = trials.KillTrial(number, kind, random.Random(f"{arguments.seed} {number}"), undisturbed, place, private)
        started = time.monotonic()
        kinds[kind](trial)
        trial.faults += [f"{path.relative_to(work)} lies outside the capture" for path in _outside(watched)]
        found.setdefault(kind, []).append(trial)
        print(
            f"{number:4} {kind:8} {'fault' if trial.faults else 'ok':6}{time.monotonic() - started:5.1f} s  "
            f"{trial.where}",
            flush=True,
        )
        for fault in trial.faults:
            print(f"     {fault}", flush=True)
        disk.unmount(place)
        for left in work.glob(f"trials/{number}*"):
            shutil.rmtree(left) if left.is_dir() else left.unlink()
    return _tell(found, arguments, figures, private, time.monotonic() - began)


def _draw(arguments: argparse.Namespace) -> list[str]:
    """The kinds of all trials: rounds of the mix, each in an order of its own. The same seed gives the same."""
    allowed = [kind for kind in MIX if NAMES.index(NEEDS.get(kind, NAMES[0])) <= NAMES.index(arguments.until)]
    rng, drawn = random.Random(arguments.seed), []
    while len(drawn) < arguments.count:
        turn = [kind for kind in allowed for _ in range(MIX[kind])]
        rng.shuffle(turn)
        drawn += turn
    return drawn[: arguments.count]


def _outside(watched: tuple[Path, Path]) -> list[Path]:
    """What lies in the watched folders; it is taken away, so that no other trial is blamed."""
    found = []
    for path in (path for folder in watched for path in folder.iterdir()):
        empty = not any(inside.is_file() for inside in path.rglob("*"))
        # Blender makes that when it starts
        if not (path.name.startswith(BLENDERS_OWN) or path.name == ".cache" and empty):
            found.append(path)
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return found


def _tell(
    trials_by_kind: dict[str, list], arguments: argparse.Namespace, figures, private: bool, seconds: float
) -> int:
    rows = {
        kind: {
            "trials": len(trials),
            "struck": sum(trial.struck for trial in trials),
            "faultless": sum(not trial.faults for trial in trials),
        }
        for kind, trials in sorted(trials_by_kind.items(), key=lambda item: list(MIX).index(item[0]))
    }
    rows["all"] = {name: sum(row[name] for row in rows.values()) for name in ("trials", "struck", "faultless")}
    print(f"\n{'':10}{'trials':>8}{'struck':>8}{'faultless':>11}")
    for kind, row in rows.items():
        print(f"{kind:10}{row['trials']:8}{row['struck']:8}{row['faultless']:11}")
    for trial in (trial for trials in trials_by_kind.values() for trial in trials if trial.faults):
        print(
            f"Again: python -m research.benchmarks.kills --count {arguments.count} --seed {arguments.seed} --only "
            f"{trial.number}  # {trial.kind}: {trial.faults[0]}"
        )
    print(f"\n{rows['all']['trials']} trials in {seconds / 60:.1f} minutes.")
    if arguments.json:
        figures.write_record(
            arguments.json,
            "kills",
            "python -m research.benchmarks.kills --count COUNT --seed SEED",
            {"rows": rows, "seed": arguments.seed, "minutes": seconds / 60, "own_disks": private},
        )
    return 0 if rows["all"]["trials"] and rows["all"]["faultless"] == rows["all"]["trials"] else 1


if __name__ == "__main__":
    sys.exit(main())
