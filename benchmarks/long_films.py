# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of long films: the sample video played to and fro with noise of its own, `python -m benchmarks.long_films FOLDER [--frames 60 120 300 1000]`.

For each length: seconds of the stage cameras, frames registered, and the camera centres' error against the true ones (cameras_against_truth.py). What is
in FOLDER already is measured anew, but not filmed anew.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.cameras_against_truth import compare  # noqa: E402
from benchmarks.costs import VIDEO, decoded, length, to_and_fro  # noqa: E402
from core.__main__ import main as core  # noqa: E402
from core.contract.capture import Capture  # noqa: E402
from core.synthetic.sample import write_video  # noqa: E402

FRAMES = (60, 120, 300, 1000)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--frames", type=int, nargs="+", default=FRAMES, metavar="N")
    chosen = options.parse_args()
    rows = [row(chosen.folder, count) for count in chosen.frames]
    print("\n| frames | cameras, s | registered | centre error, median and most, % of the distance | rotation, degrees | found by |")
    print("| --- | --- | --- | --- | --- | --- |")
    print("\n".join(rows))


def row(folder: Path, count: int) -> str:
    """A line of the table."""
    truth, capture = folder / f"film_{count}", Capture(folder / f"film_{count}.wildcap")
    video = truth / "film.mp4"
    if not video.is_file():
        film(video, count)
    core(["run", str(video), str(capture.root), "--until", "frames", "--set", f"frames.max_frames={count}"])
    core(["run", str(video), str(capture.root), "--from", "cameras", "--until", "cameras", "--set", f"frames.max_frames={count}"])
    figures, stage = compare(capture, truth), json.loads((capture.root / "capture.json").read_text(encoding="utf-8"))["stages"]["cameras"]
    median, most, turned = (figures[name] for name in ("centre_error_median_percent", "centre_error_max_percent", "rotation_error_median_deg"))
    return (f"| {count} | {stage['seconds']:.0f} | {figures['registered']} | {median:.3f}, {most:.3f} | {turned:.3f} | {stage['figures']['features']} |")


def film(video: Path, count: int) -> None:
    """The film and, beside it, its true cameras."""
    video.parent.mkdir(parents=True, exist_ok=True)
    true = json.loads(VIDEO.with_name("cameras.json").read_text(encoding="utf-8"))
    whole = length(VIDEO)
    turn = [min(at, 2 * whole - 2 - at) for at in (number % (2 * whole - 2) for number in range(count))]
    cameras = [{**true["cameras"][at], "frame": number} for number, at in enumerate(turn)]
    video.with_name("cameras.json").write_text(json.dumps({**true, "cameras": cameras}), encoding="utf-8")
    write_video(video, to_and_fro(decoded(VIDEO), count))


if __name__ == "__main__":
    main()
