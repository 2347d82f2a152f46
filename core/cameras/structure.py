# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Structure from motion over a capture's frames: starts COLMAP's process, follows it, and gives back its model."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import pycolmap

from ..contract.capture import Capture
from ..contract.frame_records import VIDEO, FrameRecord, Frames
from ..contract.messages import Problem, Reporter
from ..geometry.models import read_model
from ..imaging import images
from .matches import Matches, read_matches

ALL_PAIRS = 40
"""Up to this many frames all pairs are matched; beyond, those near each other in the video."""
STEPS = {"finding features": (0.0, 0.4), "matching features": (0.4, 0.6), "placing cameras": (0.6, 1.0)}
NO_MODEL = 3


def solve_structure(frames: Frames, capture: Capture, skin: bool, matching: str, seed: int, report: Reporter,
                    masks: Path | None = None) -> tuple[pycolmap.Reconstruction | None, Matches]:
    """The largest model of the capture's `frames`, in COLMAP's own world (None where nothing fits together),
    and all matches. `masks`: folder with NAME.png, where black hides what moves otherwise."""
    records, folder = frames.records, capture.frames
    sequential = matching == "sequential" or (matching == "auto" and frames.kind == VIDEO and len(records) > ALL_PAIRS)
    with capture.workspace() as work:
        job = {"images": str(folder.resolve()), "groups": camera_groups(records, folder), "skin": skin, "sequential": sequential,
               "masks": str(masks) if masks else None, "seed": seed, "database": str(work / "database.db"), "output": str(work / "model")}
        path = work / "job.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        try:
            model = read_model(Path(job["output"])) if _follow(path, report) else None
        except (OSError, ValueError) as error:
            raise Problem(f"The camera solver left a model that cannot be used ({error}).", "Run the stage cameras again.") from error
        return model, read_matches(Path(job["database"]))


def camera_groups(records: Sequence[FrameRecord], folder: Path) -> list[dict]:
    """Frames that share a camera, those of one size and one focal length: [{names, width, height, focal_px or None}]."""
    groups = {}
    for record in records:
        width, height = images.size(folder / record.name)
        key = width, height, record.focal_px
        groups.setdefault(key, []).append(record.name)
    return [{"names": names, "width": w, "height": h, "focal_px": f} for (w, h, f), names in groups.items()]


def _follow(job: Path, report: Reporter) -> bool:
    """Runs COLMAP's process, reporting its progress; ends it at a cancel. True where it made a model."""
    command = [sys.executable, "-E", "-s", "-B", "-m", f"{__package__}.colmap", str(job)]
    process = subprocess.Popen(command, cwd=Path(__file__).parents[2], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8")
    lines = queue.SimpleQueue()
    reader = threading.Thread(target=lambda: [lines.put(line) for line in process.stdout], daemon=True)
    reader.start()
    share, step = 0.0, "finding features"
    try:
        while reader.is_alive() or not lines.empty():
            try:
                said = json.loads(lines.get(timeout=0.2))
                low, high = STEPS[said["step"]]
                share, step = low + (high - low) * said["done"] / said["of"], said["step"]
            except (queue.Empty, ValueError, KeyError):
                pass
            report.progress(share, 1, step)
        code = process.wait()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        process.stdin.close()
        process.stdout.close()
    if code not in (0, NO_MODEL):
        raise Problem(f"The camera solver stopped unexpectedly (code {code}).",
                      "Close other programs to free memory, or lower frames.max_frames, and run again.")
    return code == 0
