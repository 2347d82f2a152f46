# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare two captures byte for byte, pictures to the last bit of every pixel, to judge a change that changes nothing.

    python -m research.benchmarks.same_maps BEFORE.wildcap AFTER.wildcap

Compares every file that a stage of the chain writes. Exit code 1 where one differs or is missing on one side. The same
seed and settings give the same bytes on one machine; another processor may round otherwise.
"""

import sys
from pathlib import Path

from core.capture import stages
from core.capture.capture import Capture
from core.capture.hashes import hash_tree

from .figures import command_line


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    options = parser.parse_args()
    one, other = Capture(options.before), Capture(options.after)
    compared = different = 0
    for stage in stages.STAGES:
        before, after = written(one, stage), written(other, stage)
        names = before.keys() | after.keys()
        unlike = sorted(
            name
            for name in names
            if before.get(name) != after.get(name) and not same_pixels(one.root / name, other.root / name)
        )
        compared, different = compared + len(names), different + len(unlike)
        more = f", {len(unlike)} are not: {', '.join(unlike[:4])}" if unlike else ""
        print(f"{stage.label:12} {len(names) - len(unlike):4} files are the same{more}")
    print(f"{compared - different} of {compared} files are the same.")
    return 1 if different or not compared else 0


def same_pixels(first: Path, second: Path) -> bool:
    """Return True if two PNG files that are packed differently hold the same values."""
    if first.suffix != ".png" or not (first.is_file() and second.is_file()):
        return False
    import numpy as np

    from core.imaging import images

    return images.bits(first) == images.bits(second) and np.array_equal(
        images.read_data(first), images.read_data(second)
    )


def written(capture: Capture, stage: stages.Stage) -> dict[str, str]:
    """Return the files that a stage wrote: name relative to the capture -> content hash."""
    found = {}
    for name in stage.writes:
        hashes = hash_tree(capture.root / name) or {}
        found |= {
            f"{name}{inside}": digest
            for inside, digest in ({"": hashes} if isinstance(hashes, str) else hashes).items()
        }
    return found


if __name__ == "__main__":
    sys.exit(main())
