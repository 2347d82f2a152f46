# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same head rendered by several Blenders: how far their linear pictures lie apart.

    python -m benchmarks.blender_versions CAPTURE [--lights three_point overcast] [--resolution 192] [--samples 64]

Each Blender module (.blenders/* of `make test-blenders`, and the one in .venv) renders in a process of its own, from a
copy of the capture, through the add-on's own functions. Exit code 1 when a pair differs by more than LIMITS.
"""

from __future__ import annotations

import argparse
import itertools
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from core.contract.capture import Capture
from core.imaging import images

ROOT = Path(__file__).resolve().parent.parent
USED = ("capture.json", "head.obj", "maps", "maps_4k", "delivery/displacement.exr")
LIMITS = {"mean": 0.01, "rmse": 0.05}
"""Of the difference of the means, and of the pixels' root mean square difference (noise included), over the mean of the
picture"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--lights", nargs="+", default=["three_point", "overcast"])
    parser.add_argument("--resolution", type=int, default=192)
    parser.add_argument("--samples", type=int, default=64)
    asked = parser.parse_args()
    pythons = [*sorted(ROOT.glob(".blenders/*/bin/python")), ROOT / ".venv" / "bin" / "python"]
    with tempfile.TemporaryDirectory() as folder:
        shown = dict(rendered(python, asked, Path(folder)) for python in pythons)
    worst = 0
    print(f"{'light':14}{'Blenders':>18}{'mean':>9}{'rmse':>9}")
    for (a, first), (b, second) in itertools.combinations(shown.items(), 2):
        for light in asked.lights:
            figures = difference(first[light], second[light])
            print(f"{light:14}{f'{a}, {b}':>18}" + "".join(f"{100 * figures[name]:8.2f}%" for name in LIMITS))
            worst += any(figures[name] > limit for name, limit in LIMITS.items())
    return 1 if worst or len(shown) < 2 else 0


def rendered(python: Path, asked: argparse.Namespace, folder: Path) -> tuple[str, dict[str, np.ndarray]]:
    """The version of that Python's Blender, and its linear pictures by light."""
    version = subprocess.run([python, "-c",
                              "import bpy; print(bpy.app.version_string, flush=True); import os; os._exit(0)"],
                             check=True, capture_output=True, text=True).stdout.splitlines()[-1].split()[0]
    copy = Capture(folder / f"{version}.wildcap")
    for name in USED:
        source, target = asked.capture / name, copy.root / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target)
        elif source.is_file():
            shutil.copyfile(source, target)
    subprocess.run([python, "-m", "benchmarks.render_capture", copy.root, *asked.lights, "--resolution",
                    str(asked.resolution),
                    # the oldest module crashes at its exit
                    "--samples", str(asked.samples)], cwd=ROOT, stdout=subprocess.DEVNULL)
    return version, {light: images.read_data(copy.renders / f"{light}.exr")[..., :3] for light in asked.lights}


def difference(a: np.ndarray, b: np.ndarray) -> dict[str, float]:
    """Of two linear pictures [H, W, 3], over the mean of both."""
    mean = float((a.mean() + b.mean()) / 2)
    return {"mean": abs(float(a.mean() - b.mean())) / mean, "rmse": float(np.sqrt(((a - b) ** 2).mean())) / mean}


if __name__ == "__main__":
    sys.exit(main())
