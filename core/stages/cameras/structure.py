# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Structure from motion over a capture's frames, by COLMAP in a process of its own."""

from __future__ import annotations

import json
import math
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

import numpy as np
import pycolmap

from ...capture.capture import Capture
from ...capture.frame_records import FULL, PHOTOGRAPHS, VIDEO, FrameRecord, Frames
from ...capture.messages import Problem, Reporter
from ...capture.stages import advise_again
from ...geometry.models import read_model
from ...imaging import images
from . import skeleton
from .colmap import CHOSEN
from .matches import Matches, read_matches

ALL_PAIRS_FRAMES = 40
"""Up to this many frames all pairs are matched; beyond, those near each other in the video."""
STEPS = {"finding features": (0.0, 0.4), "matching features": (0.4, 0.6), "placing cameras": (0.6, 1.0)}
NO_MODEL = 3
"""Exit code of the process that looks for a structure, where it finds none."""


def solve_structure(
    frames: Frames, capture: Capture, skin: bool, matching: str, seed: int, report: Reporter, masks: Path | None = None
) -> tuple[pycolmap.Reconstruction | None, Matches]:
    """Return the largest model of the capture's frames, in COLMAP's world, or None, and all matches.

    Photographs are read at the size at which they are stored, though not with masks; pixels are always those of the
    frames. `skin`: detect features that hold on low-contrast skin; `matching`: "auto", "sequential" or "exhaustive";
    `masks`: a folder with NAME.png, black where something else moves.
    """
    records, folder = frames.records, capture.frames
    is_film = frames.kind == VIDEO and len(records) > ALL_PAIRS_FRAMES
    sequential = matching == "sequential" or (matching == "auto" and is_film)
    with capture.workspace() as work:
        groups = camera_groups(records, folder)
        few = frames.kind == PHOTOGRAPHS and len(records) <= ALL_PAIRS_FRAMES
        looked_at = groups if masks else _enlarged(groups, folder)
        name_of = {PurePosixPath(name).name: name for group in looked_at for name in group["names"]}
        job = {
            "images": str(folder.resolve()),
            "groups": looked_at,
            "skin": skin,
            "film": [(name_of[name], *told) for name, *told in film_of(records)] if sequential else None,
            "photographs": few,
            "zoomed": frames.kind == VIDEO and len({record.zoom for record in records}) > 1,
            "finer": skin or not sequential,
            "masks": str(masks) if masks else None,
            "seed": seed,
            "database": str(work / "database.db"),
            "output": str(work / "model"),
        }
        path = work / "job.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        try:
            model = read_model(Path(job["output"])) if _follow(path, report) else None
        except (OSError, ValueError) as error:
            raise Problem(
                f"The camera solver left a model that cannot be used ({error}).", advise_again("cameras")
            ) from error
        matches = read_matches(Path(job["database"]))
        sizes = {name: (group["width"], group["height"]) for group in groups for name in group["names"]}
        scales = {}
        for group in job["groups"]:
            for name in group["names"]:
                width, height = sizes[PurePosixPath(name).name]
                scales[name] = [width / group["width"], height / group["height"]]
        if model is not None:
            _reduce(model, sizes)
        return model, matches.scaled(scales)


def match_crops(
    boxes: dict[str, tuple[int, int, int, int]], frames: Frames, capture: Capture, seed: int, report: Reporter
) -> tuple[Matches, list[str]]:
    """Match fine features within one box of each frame of a film.

    `boxes` maps names to (left, top, right, bottom) in pixels. Returns the matches in the frames' pixels, and the
    frames that carry the film there.
    """
    with capture.workspace() as work:
        (work / "parts").mkdir()
        names = {}
        for done, record in enumerate(frames.records):
            report.progress(done, len(frames.records), "cutting out the head")
            if record.name in boxes:
                left, top, right, bottom = boxes[record.name]
                images.write_srgb(
                    work / "parts" / record.name,
                    images.read_srgb(capture.frames / record.name)[top:bottom, left:right],
                    quality=100,
                )
                names.setdefault((right - left, bottom - top), []).append(record.name)
        groups = [
            {"names": same, "width": width, "height": height, "focal_px": None}
            for (width, height), same in names.items()
        ]
        job = {
            "images": str(work / "parts"),
            "groups": groups,
            "skin": False,
            "photographs": False,
            "zoomed": False,
            "finer": True,
            "masks": None,
            "seed": seed,
            "film": [frame for frame in film_of(frames.records) if frame[0] in boxes],
            "database": str(work / "parts.db"),
            "output": None,
        }
        path = work / "parts.json"
        path.write_text(json.dumps(job), encoding="utf-8")
        _follow(path, report)
        matches, chosen = read_matches(Path(job["database"])), json.loads((work / CHOSEN).read_text(encoding="utf-8"))
    return Matches(
        {name: pixels + boxes[name][:2] for name, pixels in matches.keypoints.items()}, matches.pairs
    ), chosen


def film_of(records: Sequence[FrameRecord]) -> skeleton.Film:
    """Describe the frames for the choice of those that carry a film."""
    return [(record.name, record.sharpness, record.yaw_deg) for record in records]


def camera_groups(records: Sequence[FrameRecord], folder: Path) -> list[dict]:
    """Group frames of one size, focal length and zoom: [{names, width, height, focal_px or None, zoom}]."""
    groups = {}
    for record in records:
        width, height = images.size(folder / record.name)
        key = width, height, record.focal_px, record.zoom
        groups.setdefault(key, []).append(record.name)
    return [
        {"names": names, "width": w, "height": h, "focal_px": f, "zoom": zoom}
        for (w, h, f, zoom), names in groups.items()
    ]


def _enlarged(groups: list[dict], folder: Path) -> list[dict]:
    """Return the groups of the larger pictures, named full/NAME; frames that have none stay."""
    split: dict[tuple, dict] = {}
    for number, group in enumerate(groups):
        for name in group["names"]:
            there = (folder / FULL / name).is_file()
            width, height = images.size(folder / FULL / name) if there else (group["width"], group["height"])
            diagonal = math.hypot(group["width"], group["height"])
            focal = group["focal_px"] and group["focal_px"] * math.hypot(width, height) / diagonal
            one = split.setdefault(
                (number, width, height), {"names": [], "width": width, "height": height, "focal_px": focal}
            )
            one["names"].append(f"{FULL}/{name}" if there else name)
    return list(split.values())


def _reduce(model: pycolmap.Reconstruction, sizes: dict[str, tuple[int, int]]) -> None:
    """Scale a model of the larger pictures to the frames' names and sizes (name to width, height), in place."""
    before = {number: (camera.width, camera.height) for number, camera in model.cameras.items()}
    for image in model.images.values():
        image.name = PurePosixPath(image.name).name
        camera = model.cameras[image.camera_id]
        scale = np.divide(sizes[image.name], before[image.camera_id])
        if (camera.width, camera.height) != sizes[image.name]:
            camera.rescale(*sizes[image.name])
        if (scale != 1).any():
            for point in image.points2D:
                point.xy = point.xy * scale
    model.update_point_3d_errors()


def _follow(job: Path, report: Reporter) -> bool:
    """Run COLMAP's process and report its progress; end it at a cancel. Return True if it made a model."""
    command = [sys.executable, "-E", "-s", "-B", "-m", f"{__package__}.colmap", str(job)]
    process = subprocess.Popen(
        command,
        cwd=Path(__file__).parents[3],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    )
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
        raise Problem(
            f"The camera solver stopped unexpectedly (code {code}).",
            "Close other programs to free memory, or lower frames.max_frames, and run again.",
        )
    return code == 0
