# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage cameras: frames become cameras/, a COLMAP model in the head's world: metres, +Z up, face towards -Y,
origin midway between the eyes. Plain feature settings come first; those that hold on skin only where the plain ones fail.
"""

from __future__ import annotations

import json
import time

import numpy as np
import pycolmap

from .. import images
from ..capture import Capture, replacing_folder
from ..messages import Problem, Reporter
from ..settings import Settings
from .drawing import draw_cameras
from .structure import solve_structure
from .world import find_head

LEAST_SHARE = 0.6
LEAST_VIEWS = 3
LEAST_COVERAGE_DEG = 15.0
MOST_ERROR_PX = 2.0


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Writes capture.cameras. Raises Problem where too few frames fit together, the camera hardly moved, or the head moved on its own."""
    started = time.monotonic()
    frames = json.loads(capture.frames_json.read_text(encoding="utf-8"))
    model, features = _solve(frames, capture, settings, report)
    head = find_head(model, frames["frames"], capture.frames, settings.cameras.interpupillary_mm / 1000, report)
    model.transform(head.world_from_model)
    coverage = coverage_deg(_centres(model))
    if coverage < LEAST_COVERAGE_DEG:
        raise Problem(f"The camera moved only {coverage:.0f} degrees around the head; {LEAST_COVERAGE_DEG:.0f} are the least.",
                      "Film again while you walk around the face from one ear to the other.")
    with replacing_folder(capture.cameras) as folder:
        model.write_binary(str(folder))
        report.check()
    images.write_srgb(capture.picture("cameras", "world"), draw_cameras(model, frames["frames"], capture.frames))
    registered = model.num_reg_images()
    for name, value in (("frames_registered", registered), ("share_registered", round(registered / len(frames["frames"]), 3)),
                        ("reprojection_error_px", round(model.compute_mean_reprojection_error(), 3)), ("sparse_points", model.num_points3D()),
                        ("angular_coverage_deg", round(coverage, 1)), ("landmark_error_px", round(head.error_px, 2)),
                        ("focal_px", round(float(np.mean([c.mean_focal_length() for c in model.cameras.values()])), 1)),
                        ("features", features), ("solve_s", round(time.monotonic() - started, 1))):
        report.figure(name, value)


def _solve(frames: dict, capture: Capture, settings: Settings, report: Reporter) -> tuple[pycolmap.Reconstruction, str]:
    """The first model that passes the gate. Raises Problem with the best attempt's shortcoming."""
    attempts = ("plain", "skin") if settings.cameras.features == "auto" else (settings.cameras.features,)
    for features in attempts:
        model = solve_structure(frames, capture.frames, features == "skin", settings.cameras.matching, settings.seed, report)
        shortcoming = _shortcoming(model, len(frames["frames"]))
        if shortcoming is None:
            return model, features
        report.log(f"With {features} features: {shortcoming}")
    raise Problem(shortcoming, "Film again: the person sits still, the camera moves slowly around the face at arm's length, "
                               "and the background is busy rather than a white wall.")


def _shortcoming(model: pycolmap.Reconstruction | None, frames: int) -> str | None:
    registered = model.num_reg_images() if model else 0
    if registered < LEAST_VIEWS:
        return "The frames do not fit together: no common structure was found in three of them."
    if registered < LEAST_SHARE * frames:
        return f"Only {registered} of {frames} frames fit together."
    error = model.compute_mean_reprojection_error()
    if error > MOST_ERROR_PX:
        return f"The frames fit together only roughly ({error:.1f} px off on average)."
    return None


def _centres(model: pycolmap.Reconstruction) -> np.ndarray:
    return np.array([image.projection_center() for image in model.images.values() if image.has_pose])


def coverage_deg(centres: np.ndarray) -> float:
    """The widest angle between two cameras [N, 3] as seen from the head (the origin)."""
    directions = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(directions @ directions.T, -1, 1)).max()))
