# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether two captures hold the same results, byte for byte, pictures to the last bit of every pixel: what a change
that should change nothing is judged by.

    python -m research.benchmarks.same_maps BEFORE.wildcap AFTER.wildcap

Compares every file that a stage of the chain writes. Exit code 1 where one differs or is missing on one side. The same
seed and settings give the same bytes on one machine; another processor may round otherwise.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from core.capture import stages
from core.capture.capture import Capture
from core.capture.hashes import hash_tree
from core.imaging import images


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    arguments = parser.parse_args()
    one, other = Capture(arguments.before), Capture(arguments.after)
    compared = different = 0
    for stage in stages.STAGES:
        before, after = (written(capture, stage) for capture in (one, other))
        names = before.keys() | after.keys()
        unlike = sorted(
            name
            for name in names
            if before.get(name) != after.get(name) and not same_pixels(one.root / name, other.root / name)
        )
        compared, different = compared + len(names), different + len(unlike)
        print(
            f"{stage.label:12} {len(names) - len(unlike):4} files are the same"
            + (f", {len(unlike)} are not: {', '.join(unlike[:4])}" if unlike else "")
        )
    print(f"{compared - different} of {compared} files are the same.")
    return 1 if different or not compared else 0


def same_pixels(first: Path, second: Path) -> bool:
    """Return whether two PNG files that are packed differently hold the same values."""
    if first.suffix != ".png" or not (first.is_file() and second.is_file()):
        return False
    return images.bits(first) == images.bits(second) and np.array_equal(
        images.read_data(first), images.read_data(second)
    )


def written(capture: Capture, stage: stages.Stage) -> dict[str, str]:
    """Return the files that a stage wrote: name relative to the capture -> content hash."""
    found = {}
    for name in stage.writes:
        told = hash_tree(capture.root / name)
        found |= (
            {f"{name}{inside}": content for inside, content in told.items()}
            if isinstance(told, dict)
            else {name: told}
            if told
            else {}
        )
    return found


if __name__ == "__main__":
    sys.exit(main())
