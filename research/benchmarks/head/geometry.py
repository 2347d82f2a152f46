# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of cameras, scan, head and texture of several captures, with the cost of each stage.

    python -m research.benchmarks.head.geometry FOLDER [--captures NAME ...] [--data FOLDER] [--fresh] [--json
    research/records/geometry.json]

Captures: `sample` (part of this repository), `lps_sun` and `bust` (in --data). FOLDER gets NAME.wildcap, NAME.json,
pictures/NAME.jpg (scan, wireframe and texture beside the frame) and geometry.json. What is finished is not done again
without --fresh: stages that are fresh, captures that came through. Captures that are in --json's record and were not
measured here stay there. The perceptual row needs `pip install --no-deps -r requirements/perceptual.txt`; without it
the table says so. Every stage runs in a process of its own, so its peak memory (of the largest of its processes, as
getrusage tells) is its own.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.frame_records import read_frames
from core.capture.messages import Problem
from core.imaging import images
from core.settings.settings import Settings

from ..costs import measure_stage
from ..figures import ROOT, read_record, write_record
from .geometry_table import published, table

LAST = "texture"
"""Stages up to this one are run."""


@dataclass(frozen=True)
class ScannedSubject:
    """Source of a capture and its truth.

    truth: laid out as research/benchmarks/maps/albedo_score.py says; mesh: the true surface, if it is not that of the
    truth.
    """

    source: Path
    truth: Path | None = None
    mesh: Path | None = None


def subjects(data: Path) -> dict[str, ScannedSubject]:
    """Return the captures by name; those of `data` that are not there are left out."""
    sample = ROOT / "research" / "people" / "sample"
    found = {
        "sample": ScannedSubject(sample / "capture.mp4", sample),
        "lps_sun": ScannedSubject(
            data / "lps_sun" / "capture.mp4", data / "lps_sun", data / "lee_perry_smith" / "LeePerrySmith.glb"
        ),
        "bust": ScannedSubject(data / "bust"),
    }
    return {name: subject for name, subject in found.items() if subject.source.exists()}


def measure_capture(name: str, subject: ScannedSubject, folder: Path, fresh: bool = False) -> dict:
    """Run a capture, compares it with the truth where there is one, and draws it.

    Returns the figures; "stopped" tells of the stage that failed, or is None."""
    capture = Capture(folder / f"{name}.wildcap")
    if fresh:
        shutil.rmtree(capture.root, ignore_errors=True)
    costs, stopped = run_stages(capture, subject.source)
    figures = {"stages": costs, "stopped": stopped}
    for part, made, compare in (
        ("cameras", capture.cameras, _cameras),
        ("scan", capture.scan, _surface),
        ("head", capture.head, _surface),
        ("texture", capture.head, _texture),
    ):
        if not made.exists():  # "stopped" says why
            continue
        print(f"{name}: {part}", flush=True)
        try:
            figures[part] = compare(capture, subject, part)
        except Exception as error:  # one comparison that fails must not cost the others, and is told
            figures[part] = {"not_measured": f"{type(error).__name__}: {error}"}
    picture = folder / "pictures" / f"{name}.jpg"
    try:
        from ..pictures.geometry_pictures import sheet

        images.write_srgb(picture, sheet(capture))
        figures["picture"] = picture.name
    except (Problem, OSError, ValueError, IndexError) as error:
        figures["picture"] = f"not drawn: {error}"
    return figures


def run_stages(capture: Capture, source: Path) -> tuple[dict, dict | None]:
    """Return the seconds and peak memory (MB) of each stage, and the problem that ended the run, or None.

    Costs of stages that were fresh are kept.
    """
    path = capture.root / "costs.json"
    costs = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    for stage in stages.NAMES[: stages.NAMES.index(LAST) + 1]:
        if stage in costs and capture.state(stages.by_name(stage), Settings()) == "done":
            continue
        print(f"{capture.root.stem}: stage {stage}", flush=True)
        cost = measure_stage(capture.root, stage, source.absolute())
        if "problem" in cost:
            return costs, {"stage": stage, **cost}
        costs[stage] = cost
        write_json(path, costs)
    return costs, None


def _cameras(capture: Capture, subject: ScannedSubject, section: str) -> dict:
    import pycolmap

    from core.geometry.views import read_views

    from .cameras_against_truth import compare

    frames = len(read_frames(capture).records)
    views = read_views(capture)
    figures = {
        "frames": frames,
        "registered_percent": 100 * len(views) / frames,
        "reprojection_px": pycolmap.Reconstruction(str(capture.cameras)).compute_mean_reprojection_error(),
    }
    return {
        **figures,
        **(
            {"against_truth": {k: float(v) for k, v in compare(capture, subject.truth).items()}}
            if subject.truth
            else {}
        ),
    }


def _surface(capture: Capture, subject: ScannedSubject, section: str) -> dict:
    from .head_against_truth import compare_surface

    figures = capture.read()["stages"].get({"scan": "scan", "head": "registration"}[section], {}).get("figures", {})
    if subject.truth is None:
        return {"own": figures}
    return {
        "own": figures,
        "against_truth": compare_surface(
            capture, subject.truth, subject.mesh, {"scan": "scan.ply", "head": "head.obj"}[section]
        ),
    }


def _texture(capture: Capture, subject: ScannedSubject, section: str) -> dict:
    from ..maps.texture import measure_rows as measure_texture

    figures = capture.read()["stages"].get("texture", {}).get("figures", {})
    return {"own": figures, **({"alone": measure_texture(capture, subject.truth)} if subject.truth else {})}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--captures", nargs="+", metavar="NAME", help="of sample, lps_sun, bust; all that are there by default"
    )
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--fresh", action="store_true", help="do everything again")
    parser.add_argument("--json", type=Path, help="where the tables' figures go")
    options = parser.parse_args()
    known = subjects(options.data)
    missing = set(options.captures or ()) - set(known)
    if missing:
        parser.error(f"there is no capture named {', '.join(sorted(missing))}; there are {', '.join(known)}")
    folder = options.folder.resolve()
    for name in options.captures or known:
        result = folder / f"{name}.json"
        if result.is_file() and not options.fresh and json.loads(result.read_text(encoding="utf-8"))["stopped"] is None:
            continue
        started = time.monotonic()
        figures = measure_capture(name, known[name], folder, options.fresh)
        write_json(result, {**figures, "minutes": round((time.monotonic() - started) / 60, 1)})
    everything = {
        name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        for name in known
        if (folder / f"{name}.json").is_file()
    }
    write_json(folder / "geometry.json", everything)
    if options.json:
        others = read_record(options.json.stem, options.json.parent)["figures"] if options.json.is_file() else {}
        write_record(
            options.json,
            "geometry",
            "python -m research.benchmarks.head.geometry FOLDER",
            {**others, **published(everything)},
        )
    print(table(everything))


if __name__ == "__main__":
    main()
