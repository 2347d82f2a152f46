# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Throw spoiled files and odd names at the chain, and judges by itself whether each was met as it should be.

    python -m research.benchmarks.hostile [--count 1000] [--seed 0] [--only K] [--until transfer] [--json
    research/records/hostile.json]

A case is a copy of a small finished capture (eight frames of the sample video) with files of the user's in it, one
thing spoiled, and the stage or command that reads it, in a process forked from one in which everything is imported. It
has to end well, with outputs that are finite and complete, or with exit code 2 and two sentences of which the first
names the spoiled file: no traceback, no "error inside WildCap", no signal, no hang, no memory without end, none of the
user's files lost or changed. Exit code 0 only where all of that held in every case. Linux.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from core.capture.stages import NAMES
from core.worker.client import THREAD_VARIABLES


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="K", help="case number K alone, as of a fault; its output is shown")
    parser.add_argument("--until", choices=NAMES, default=NAMES[-1], help="the last stage that is tried")
    parser.add_argument("--delighter", default="network")
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/hostile.json")
    arguments = parser.parse_args()
    os.environ |= dict.fromkeys(THREAD_VARIABLES, "1")
    work = Path(tempfile.mkdtemp(prefix="wildcap_hostile_", dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    try:
        return _run(arguments, work)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _run(arguments: argparse.Namespace, work: Path) -> int:
    # numerical libraries ask for the number of threads when they are loaded
    from .. import figures
    from ..kills import capture, worker
    from . import cases, run

    began = time.monotonic()
    worker.warm_up()
    undisturbed = capture.run_undisturbed(
        work / "undisturbed", arguments.until, arguments.delighter, tell=lambda text: None
    )
    stock = cases.Stock(undisturbed, work / "stock")
    print(f"A capture was made in {time.monotonic() - began:.0f} s.", flush=True)
    kinds = cases.kinds(undisturbed.names)
    rows: dict[str, Counter] = {}
    faulty = []
    for number in range(arguments.count):
        if arguments.only not in (None, number):
            continue
        rng = random.Random(f"{arguments.seed} {number}")
        kind = rng.choices(list(kinds), [kind.weight for kind in kinds.values()])[0]
        place = work / "cases" / str(number)
        case = cases.make_case(kinds[kind], place, stock, rng)
        ended = run.run(case)
        faults = run.judge(case, ended)
        row = rows.setdefault(kind, Counter())
        row.update(cases=1, refused=ended.code == 2, accepted=ended.code == 0, faults=bool(faults))
        if faults:
            faulty.append((number, kind, case.said, faults))
            print(f"{number:5} {kind}: {case.said}", *(f"      {fault}" for fault in faults), sep="\n", flush=True)
        if arguments.only is not None:
            print(
                f"{kind}: {case.said}\nexit code {ended.code} after {ended.seconds:.1f} s and {ended.peak / 1e9:.2f} "
                f"GB\n{ended.output}"
            )
        shutil.rmtree(place, ignore_errors=True)
    print(f"\n{'':24}{'cases':>8}{'refused':>9}{'accepted':>10}{'faults':>8}")
    total = sum(rows.values(), Counter())
    for name, row in (*sorted(rows.items()), ("all", total)):
        print(f"{name:24}{row['cases']:8}{row['refused']:9}{row['accepted']:10}{row['faults']:8}")
    for number, *_ in faulty[:20]:
        print(
            f"Again: python -m research.benchmarks.hostile --seed {arguments.seed} --count {arguments.count} --until "
            f"{arguments.until} "
            f"--delighter {arguments.delighter} --only {number}"
        )
    seconds = time.monotonic() - began
    print(f"{total['cases']} cases in {seconds / 60:.1f} minutes, seed {arguments.seed}.")
    if arguments.json:
        figures.write_record(
            arguments.json,
            "hostile",
            "python -m research.benchmarks.hostile --count COUNT --seed SEED",
            {
                "rows": {name: dict(row) for name, row in rows.items()},
                "all": dict(total),
                "seed": arguments.seed,
                "minutes": seconds / 60,
            },
        )
    return 0 if total["cases"] and not total["faults"] else 1


if __name__ == "__main__":
    sys.exit(main())
