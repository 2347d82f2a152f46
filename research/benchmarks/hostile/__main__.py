# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Give spoiled files and odd names to the chain, and judge whether each was met as it should be.

    python -m research.benchmarks.hostile [--count 1000] [--seed 0] [--only K] [--kind NAME] [--until transfer]
        [--json research/records/hostile.json]

A case is a copy of a small finished capture (eight frames of the sample video) with the user's files in it, one thing
spoiled, and the stage or command that reads it, in a process forked from one in which everything is imported. It must
end well, with finite and complete outputs, or with exit code 2 and two sentences of which the first names the spoiled
file: no traceback, no "error inside WildCap", no signal, no hang, no endless memory, none of the user's files lost or
changed. Exit code 0 only if all of that held in every case. Linux.
"""

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

from .. import figures
from ..kills import capture, worker
from .cases import KINDS, Stock, make_case
from .run import judge, run


def main() -> int:
    parser = figures.command_line(__doc__, "hostile")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="K", help="case number K alone, as of a fault; its output is shown")
    parser.add_argument("--kind", choices=KINDS, help="cases of this kind alone")
    parser.add_argument("--until", choices=NAMES, default=NAMES[-1], help="the last stage that is tried")
    parser.add_argument("--delighter", default="network")
    options = parser.parse_args()
    os.environ |= dict.fromkeys(THREAD_VARIABLES, "1")
    began = time.monotonic()
    work = Path(tempfile.mkdtemp(prefix="wildcap_hostile_", dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    try:
        rows = run_cases(options, work)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return report(rows, options, time.monotonic() - began)


def run_cases(options: argparse.Namespace, work: Path) -> dict[str, Counter]:
    """Run and judge all cases; kind -> counts."""
    worker.warm_up()
    undisturbed = capture.run_undisturbed(work / "undisturbed", options.until, options.delighter, lambda text: None)
    stock, rows = Stock(undisturbed, work / "stock"), {}
    kinds = {
        name: kind for name, kind in KINDS.items() if kind.needs in undisturbed.names and options.kind in (None, name)
    }
    for number in range(options.count):
        if options.only not in (None, number):
            continue
        rng = random.Random(f"{options.seed} {number}")
        kind = rng.choices(list(kinds), [kind.weight for kind in kinds.values()])[0]
        place = work / "cases" / str(number)
        case = make_case(kinds[kind], place, stock, rng)
        ended = run(case)
        faults = judge(case, ended)
        counts = rows.setdefault(kind, Counter())
        counts.update(cases=1, refused=ended.code == 2, accepted=ended.code == 0, faults=bool(faults))
        if faults:
            print(f"{number:5} {kind}: {case.description}", *(f"      {fault}" for fault in faults), sep="\n")
            words = f"--seed {options.seed} --count {options.count} --until {options.until} --only {number}"
            words += f" --kind '{options.kind}'" if options.kind else ""
            print(f"      Again: python -m research.benchmarks.hostile {words} --delighter {options.delighter}")
        if options.only is not None:
            print(f"{kind}: {case.description}\nexit code {ended.code} after {ended.seconds:.1f} s and", end=" ")
            print(f"{ended.peak / 1e9:.2f} GB\n{ended.output}")
        sys.stdout.flush()
        shutil.rmtree(place, ignore_errors=True)
    return rows


def report(rows: dict[str, Counter], options: argparse.Namespace, seconds: float) -> int:
    """Print and record the counts; the exit code."""
    total = sum(rows.values(), Counter())
    print(f"\n{'':24}{'cases':>8}{'refused':>9}{'accepted':>10}{'faults':>8}")
    for name, row in (*sorted(rows.items()), ("all", total)):
        print(f"{name:24}{row['cases']:8}{row['refused']:9}{row['accepted']:10}{row['faults']:8}")
    print(f"{total['cases']} cases in {seconds / 60:.1f} minutes, seed {options.seed}.")
    found = {"rows": {name: dict(row) for name, row in rows.items()}, "all": dict(total)}
    figures.write_record(
        options.json,
        "hostile",
        "python -m research.benchmarks.hostile --count COUNT --seed SEED",
        {**found, "seed": options.seed, "minutes": seconds / 60},
    )
    return 0 if total["cases"] and not total["faults"] else 1


if __name__ == "__main__":
    sys.exit(main())
