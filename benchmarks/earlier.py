# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What version 0.1.0 makes of captures: the same frames, cameras and head, taken from delight to the solve by its own
code and weights.

    git worktree add CHECKOUT 7ea9856
    python -m benchmarks.earlier CHECKOUT FOLDER OUT [--truths FOLDER] [--only PREFIX ...]
    python -m benchmarks.state OUT --truths FOLDER --json docs/figures/state_0_1_0.json
    python -m benchmarks.freeze OUT KEPT

FOLDER and the truths are those of benchmarks/state.py, of which nothing behind the head is needed; OUT/NAME.wildcap is
a capture of 0.1.0. What is solved there already is not solved again.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from core.contract.capture import Capture
from core.contract.files import replacing_folder, write_json

from .state_captures import add_captures

SOLVE = """
import sys
from pathlib import Path
from benchmarks.people import solve
from core.capture import Capture
solve(Capture(Path(sys.argv[1])), Path(sys.argv[2]), "solve", "standard")
"""
"""By the earlier version's own modules, whose working directory is its checkout."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", type=Path, help="a checkout of the commit of 0.1.0")
    add_captures(parser)
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    checkout, out = arguments.checkout.resolve(), arguments.out.resolve()
    if not (checkout / "core" / "capture.py").is_file():
        parser.error(f"{checkout} holds no code of 0.1.0: that has core/capture.py.")
    folder = arguments.folder.resolve()
    truths = (arguments.truths or folder).resolve()
    asked = [
        capture
        for capture in map(Capture, sorted(folder.glob("*.wildcap")))
        if capture.root.stem.startswith(tuple(arguments.only))
        and capture.head.is_file()
        and (truths / capture.root.stem / "albedo").is_dir()
    ]
    if not asked:
        parser.error(f"{folder} holds no capture with a head and a truth.")
    failed = 0
    for capture in asked:
        name, copy = capture.root.stem, copy_inputs(capture, out / capture.root.name)
        ended = subprocess.run(
            [sys.executable, "-c", SOLVE, str(copy.root), str(truths / name)],
            cwd=checkout,
            env={**os.environ, "PYTHONPATH": str(checkout)},
            check=False,
        )
        failed += ended.returncode != 0
        print(f"{name}: {'not solved' if ended.returncode else 'solved'}", flush=True)
    return 1 if failed else 0


def copy_inputs(capture: Capture, target: Path) -> Capture:
    """A capture of format 1 with another's frames, cameras and head, made if it is not there."""
    if not target.is_dir():
        with replacing_folder(target) as folder:
            for name in ("frames", "cameras"):
                shutil.copytree(capture.root / name, folder / name)
            shutil.copyfile(capture.head, folder / capture.head.name)
            write_json(folder / "capture.json", {"format": 1, "source": "", "stages": {}})
    return Capture(target)


if __name__ == "__main__":
    sys.exit(main())
