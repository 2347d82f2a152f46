# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head that turns, and talks, before a fixed camera and a bare wall, above a shirt that keeps still: what the chain
says of it, and in which time.

    python -m research.benchmarks.turning_head FOLDER [--silent] [--until STAGE] [--json
    research/records/turning_head.json]

The film is that of research/people/painted_head.py: 300 frames of 384 x 512 pixels. With --silent nobody talks in it.
FOLDER gets it and the capture; what is there is not made again. With --until cameras the chain ends there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.imaging import images

from ..people.painted_head import photograph, place_camera
from ..people.sample import write_video
from . import figures
from .costs.stage import measure_stage

FRAMES, SCALE = 300, 1.28
WIDEST_DEG = 40.0
JAW, SYLLABLE, SENTENCE = 0.35, 7, 90
"""How far the jaw opens, and frames of a syllable, and of a sentence with the pause after it."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--silent", action="store_true")
    parser.add_argument("--until", default="transfer")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    name = "silent" if arguments.silent else "talking"
    film, capture = arguments.folder / f"{name}.mp4", Capture(arguments.folder.resolve() / f"{name}.wildcap")
    if not film.is_file():
        write_video(film, pictures(0.0 if arguments.silent else JAW))
    measure_stage(capture.root, "frames", film.resolve(), "draft")
    cost = measure_stage(capture.root, "cameras", film.resolve(), "draft")
    command = [
        sys.executable,
        "-m",
        "core",
        "run",
        str(film),
        str(capture.root),
        "--quality",
        "draft",
        "--until",
        arguments.until,
    ]
    said = subprocess.run(command, cwd=figures.ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    record = capture.read()
    stages = {stage: round(done["seconds"], 1) for stage, done in record["stages"].items()}
    findings = [finding["problem"] for done in record["stages"].values() for finding in done.get("findings", [])]
    row = {
        "seconds": round(sum(stages.values()), 1),
        "stages": stages,
        "cost": cost,
        "exit": said.returncode,
        "findings": {str(k): finding for k, finding in enumerate(findings)},
        "cameras": record["stages"].get("cameras", {}).get("figures", {}),
        "stopped": record.get("stopped"),
    }
    print(said.stdout[-2000:], *findings, row, sep="\n")
    if arguments.json:
        figures.write_record(
            arguments.json, "turning_head", "python -m research.benchmarks.turning_head FOLDER", {name: row}, keep=True
        )
    return (
        0 if any("stood still" in text for text in [*findings, (record.get("stopped") or {}).get("problem", "")]) else 1
    )


def pictures(jaw: float):
    """The film's frames, sRGB [512, 384, 3]; jaw: how far it opens while the person talks."""
    view = place_camera(0, 0.03, scale=SCALE)
    checks = np.random.default_rng(2).random((40, 40, 3), np.float32) ** 2
    shirt = images.linear_to_srgb(images.resize(checks, view.width, view.width))
    y, x = np.mgrid[: view.height, : view.width]
    chest = np.sqrt(np.maximum((0.5 * view.width) ** 2 - (x - view.width / 2) ** 2, 0))
    worn = y > view.height - 0.16 * view.width - 0.25 * chest + 0.1 * view.width
    for i in range(FRAMES):
        opened = jaw * np.sin(np.pi * i / SYLLABLE) ** 2 * (i % SENTENCE < 2 * SENTENCE / 3)
        picture = photograph(view, WIDEST_DEG * np.sin(2 * np.pi * i / FRAMES), wall=False, jaw=opened)
        picture[worn] = shirt[y[worn] % view.width, x[worn]]
        yield picture


if __name__ == "__main__":
    sys.exit(main())
