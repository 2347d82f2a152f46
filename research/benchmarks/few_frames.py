# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head from a few frames of a video that lie far apart, taken as photographs and without a dense scan, against the
true mesh.

    python -m research.benchmarks.few_frames VIDEO TRUTH MESH CAPTURE [--frames N,N,...] [--scan]

TRUTH and MESH as in head_against_truth.py. By default five frames of the head scan's video (data/lps_sun) that lie 28
to 39 degrees apart, as wide as it goes, three of them with a mask of the face. --scan: with whatever surface the stage
Scan measures.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.messages import Log, Reporter
from core.geometry import meshes
from core.geometry.views import read_points
from core.imaging import images
from core.settings.settings import Settings
from core.stages import cameras, frames, registration, scan

from .films import read_film
from .head_against_truth import compare_surface

FIVE = (0, 27, 51, 75, 95)


def photographs_of(video: Path, numbers: tuple[int, ...], folder: Path) -> None:
    """The frames with these numbers as pictures NNNN.png."""
    folder.mkdir(parents=True)
    for number, frame in enumerate(read_film(video)):
        if number in numbers:
            images.write_srgb(folder / f"{number:04d}.png", frame.astype(np.float32) / 255)


def truth_of(truth: Path, numbers: tuple[int, ...], folder: Path) -> None:
    """TRUTH with its frames counted as those photographs are; with the masks of those of them that have one."""
    told = json.loads((truth / "cameras.json").read_text(encoding="utf-8"))
    by_frame = {camera["frame"]: camera for camera in told["cameras"]}
    listed = [{**by_frame[number], "frame": i} for i, number in enumerate(numbers)]
    (folder / "face").mkdir(parents=True)
    (folder / "cameras.json").write_text(json.dumps({**told, "cameras": listed}), encoding="utf-8")
    for i, number in enumerate(numbers):
        if (truth / "face" / f"{number:04d}.png").is_file():
            shutil.copy(truth / "face" / f"{number:04d}.png", folder / "face" / f"{i:04d}.png")


def reconstruct(capture: Capture, source: Path, with_scan: bool) -> dict:
    """Runs the stages up to the head; their figures."""
    figures, settings = {}, Settings()
    capture.root.mkdir(parents=True)
    capture.set_source(source)
    for name, room in (("frames", frames), ("cameras", cameras), ("scan", scan), ("registration", registration)):
        report = Reporter(name, lambda message: print(message, file=sys.stderr) if isinstance(message, Log) else None)
        if name == "scan" and not with_scan:
            meshes.write_points(capture.scan, read_points(capture)[0])
            continue
        room.run(capture, settings, report)
        figures[name] = report.figures
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("video", "truth", "mesh", "capture"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--frames", default=",".join(map(str, FIVE)))
    parser.add_argument("--scan", action="store_true")
    args = parser.parse_args()
    numbers = tuple(int(number) for number in args.frames.split(","))
    capture = Capture(args.capture)
    with tempfile.TemporaryDirectory() as folder:
        photographs_of(args.video, numbers, Path(folder) / "photographs")
        truth_of(args.truth, numbers, Path(folder) / "truth")
        figures = reconstruct(capture, Path(folder) / "photographs", args.scan)
        head = compare_surface(capture, Path(folder) / "truth", args.mesh)
        print(json.dumps({"stages": figures, "head": head}, indent=1))


if __name__ == "__main__":
    main()
