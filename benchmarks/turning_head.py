# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head that turns before a fixed camera and a bare wall, above a shirt that keeps still: what the chain says of it, and in which time.

    python -m benchmarks.turning_head FOLDER [--json docs/figures/turning_head.json]

The film is that of core/synthetic/painted_head.py: 300 frames of 384 x 512 pixels. FOLDER gets it and the capture; what is there is not made again.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from core.contract.capture import Capture
from core.imaging import images
from core.synthetic.painted_head import camera, photograph
from core.synthetic.sample import write_video

from . import figures

FRAMES, SCALE = 300, 1.28
WIDEST_DEG = 40.0
ROOT = Path(__file__).resolve().parent.parent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    film, capture = arguments.folder / "turning.mp4", Capture(arguments.folder.resolve() / "turning.wildcap")
    if not film.is_file():
        write_video(film, pictures())
    started = time.monotonic()
    said = subprocess.run([sys.executable, "-m", "core", "run", str(film), str(capture.root), "--quality", "draft"], cwd=ROOT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    seconds = time.monotonic() - started
    record = capture.read()
    stages = {name: round(done["seconds"], 1) for name, done in record["stages"].items()}
    findings = [finding["problem"] for done in record["stages"].values() for finding in done.get("findings", [])]
    row = {"seconds": round(seconds, 1), "stages": stages, "exit": said.returncode, "findings": findings,
           "cameras": record["stages"].get("cameras", {}).get("figures", {}), "stopped": record.get("stopped")}
    print(said.stdout[-2000:], *findings, row, sep="\n")
    if arguments.json:
        figures.write(arguments.json, "turning_head", "python -m benchmarks.turning_head FOLDER", row)
    return 0 if any("stood still" in text for text in [*findings, (record.get("stopped") or {}).get("problem", "")]) else 1


def pictures():
    """The film's frames, sRGB [512, 384, 3]."""
    view = camera(0, 0.03, scale=SCALE)
    shirt = images.linear_to_srgb(images.resize(np.random.default_rng(2).random((40, 40, 3), np.float32) ** 2, view.width, view.width))
    y, x = np.mgrid[:view.height, :view.width]
    worn = y > view.height - 0.16 * view.width - 0.25 * np.sqrt(np.maximum((0.5 * view.width) ** 2 - (x - view.width / 2) ** 2, 0)) + 0.1 * view.width
    for i in range(FRAMES):
        picture = photograph(view, WIDEST_DEG * np.sin(2 * np.pi * i / FRAMES), wall=False)
        picture[worn] = shirt[y[worn] % view.width, x[worn]]
        yield picture


if __name__ == "__main__":
    sys.exit(main())
