# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands about an existing capture: python -m core status, delete, report-problem, mask and landmarks.

Standard library only.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..capture import artist_landmarks, deletion, report, stages
from ..capture.capture import Capture
from ..capture.freshness import has_work
from ..capture.messages import Problem
from .commands import add_command, path_of, refuse_exchanged
from .job import last_settings

ROOT = Path(__file__).resolve().parents[2]


def add_commands(commands) -> None:
    """Add the commands to the subparsers of `python -m core`."""
    add_command(commands, "status", _status, "show which stages of a capture are done", "CAPTURE")
    delete = add_command(commands, "delete", _delete, "list what WildCap wrote of a face, or delete it", "CAPTURE")
    delete.add_argument("--yes", action="store_true", help="delete it, for good")
    words = "write a zip to send: logs, versions, settings; no pictures, names or paths"
    about = add_command(commands, "report-problem", _report_problem, words)
    about.add_argument("capture", metavar="CAPTURE", type=path_of, nargs="?")
    about.add_argument("--to", metavar="ZIP", type=path_of, required=True)
    mask = commands.add_parser("mask", help="import a painted shadow mask")
    mask = mask.add_subparsers(required=True, metavar="import")
    bring = add_command(mask, "import", _mask_import, "use a picture as the shadow mask: white is shadow", "CAPTURE")
    bring.add_argument("picture", metavar="PNG", type=path_of)
    marks = commands.add_parser("landmarks", help="set landmarks by hand, in place of the detected ones")
    marks = marks.add_subparsers(required=True, metavar="set|free|import")
    put = add_command(marks, "set", _landmarks, "set one landmark in the capture's world", "CAPTURE")
    put.add_argument("index", metavar="INDEX", help="0 to 467, as in landmarks.json")
    for axis in "XYZ":
        put.add_argument(axis.lower(), metavar=axis, type=float, help="metres")
    free = add_command(marks, "free", _landmarks, "return one landmark to its detected place", "CAPTURE")
    free.add_argument("index", metavar="INDEX")
    words = 'read landmarks from a JSON file: {"points": {"152": [x, y, z]}}, metres'
    many = add_command(marks, "import", _landmarks, words, "CAPTURE")
    many.add_argument("file", metavar="JSON", type=path_of)


def _status(options: argparse.Namespace) -> int:
    """Print the stages' states under the settings of the last job."""
    capture = Capture(options.capture)
    if not capture.root.is_dir():
        raise Problem(
            f"There is no capture at {capture.root}.", "Check the name; `python -m core run SOURCE CAPTURE` makes one."
        )
    record = capture.read()
    chosen = last_settings(capture)
    print(f"source        {capture.source or 'none yet'}")
    for stage in stages.STAGES:
        if not has_work(capture.root, record, stage):
            continue
        finished, verdict = record["stages"].get(stage.name), capture.verdict(stage, chosen)
        print(
            f"{stage.name:13} {verdict.state:6}"
            + (f" {finished['seconds']:8.1f} s  {finished.get('finished', '')}" if finished else "")
            + (f"  {verdict.reason()}" if verdict.reason() else "")
        )
    if capture.shadow_mask.is_file():
        print("shadow mask   painted")
    for finding in report.findings(record):
        print(f"{'stopped' if finding['stopped'] else 'finding':13} {finding['problem']} {finding['remedy']}")
    return 0


def _delete(options: argparse.Namespace) -> int:
    capture = Capture(options.capture)
    removal = deletion.delete(capture) if options.yes else deletion.plan(capture)
    print(*deletion.lines(removal), sep="\n")
    if not options.yes:
        print("Nothing was deleted; --yes does it.")
    return 0


def _report_problem(options: argparse.Namespace) -> int:
    from . import problem_report

    capture = Capture(options.capture) if options.capture else None
    if capture is not None and not capture.json.is_file():
        raise Problem(
            f"There is no capture at {capture.root}.",
            "Check the name, or leave it out for a report about the installation alone.",
        )
    print(problem_report.write(options.to, ROOT, Path(sys.executable), capture))
    print(
        f"It holds {', '.join(problem_report.TOLD)}; no pictures, and no names or paths of yours. Nothing was sent: "
        "look into it first."
    )
    return 0


def _mask_import(options: argparse.Namespace) -> int:
    from ..imaging.mask_import import import_mask  # needs OpenImageIO

    refuse_exchanged(options.capture, options.picture, "mask import")
    print(f"{import_mask(Capture(options.capture), options.picture)} is now the shadow mask; solve comes next.")
    return 0


def _landmarks(options: argparse.Namespace) -> int:
    if "file" in options:
        refuse_exchanged(options.capture, options.file, "landmarks import")
    if "file" in options and not options.file.is_file():
        raise Problem(f"There is no file at {options.file}.", "Check its name.")
    position = (options.x, options.y, options.z) if "x" in options else None
    points = artist_landmarks.read(options.file) if "file" in options else {options.index: position}
    if not points:
        raise Problem(f"{options.file} contains no landmark.", "Give at least one, or free single ones by their index.")
    count = len(artist_landmarks.put(Capture(options.capture), points))
    print(f"{count} landmark{'' if count == 1 else 's'} put by hand; the stage registration comes next.")
    return 0
