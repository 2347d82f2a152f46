# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage cameras: frames become cameras/, a COLMAP model in the head's world.

Metres, +Z up, face towards -Y, origin midway between the eyes. Solved from matches between the frames and from the
face, or imported from another program.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap

from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...capture.frame_records import PHOTOGRAPHS, FrameRecord, Frames, read_frames
from ...capture.messages import Problem, Reporter
from ...geometry.models import write_model
from ...imaging import images
from ...settings.settings import Settings
from . import coverage
from .calibration import import_cameras
from .drawing import draw_cameras
from .joint import AGREE_WIDTH_SHARES, WIDE_WIDTH_SHARES, refine
from .landmarks import find_landmarks
from .motion import expression_changes
from .solving import FILM_AGAIN, LEAST_VIEWS, MOST_FACES, Solved, solve
from .structure import ALL_PAIRS_FRAMES, solve_structure
from .world import HeadFrame, find_head

# COLMAP's messages go to the log of the worker, not to files among the system's temporary ones; a bundle adjustment of
# pycolmap 4.2 sets the level back, but not the destinations
pycolmap.logging.minloglevel = 2
for level in (pycolmap.logging.INFO, pycolmap.logging.WARNING, pycolmap.logging.ERROR):
    pycolmap.logging.set_log_destination(level, "")

LEAST_COVERAGE_DEG = 15.0
IMPORT_MISS_SHARE = 0.05
"""Share of the face's width by which landmarks may miss in imported cameras: those of another capture, or read by other
conventions, miss by far more."""
IMPORT_NEAR_RATIO = 6.0
"""Cameras that miss by more than the next two figures, but not by so many times as much, are a few pixels off and can
be refined."""
IMPORT_UNLIKE_M = 0.004
"""How far a head may miss the landmarks in imported cameras; a person's does by 2 mm. Cameras in the wrong order may
see a hollow face."""
BLURRED_SHARPNESS_SHARE = 0.6
"""Sharpness, as a share of that of the frames that fit, below which a frame was left out for its blur."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write capture.cameras.

    Raises Problem if too few frames fit together, the camera hardly moved or the head moved on its own, or if imported
    cameras cannot be read or do not fit the frames.
    """
    started = time.monotonic()
    frames = read_frames(capture)
    import_path = settings.cameras.import_from.strip()
    solved = (
        _imported(Path(import_path).expanduser(), frames, capture, settings, report)
        if import_path
        else solve(frames, capture, settings, report)
    )
    model = solved.model
    model.transform(solved.head.world_from_model)
    centres = np.array([image.projection_center() for image in model.images.values() if image.has_pose])
    widest = coverage.widest_deg(centres)
    records = solved.to_place or frames.records
    focal = [camera.mean_focal_length() for camera in model.cameras.values()]
    if not np.isfinite([*centres.ravel(), *focal]).all():
        raise Problem("The cameras that were found hold values that are not numbers.", FILM_AGAIN)
    if widest < LEAST_COVERAGE_DEG and frames.kind != PHOTOGRAPHS:
        raise Problem(
            f"The camera moved only {widest:.0f} degrees around the head; {LEAST_COVERAGE_DEG:.0f} are the least.",
            "Film again while you walk around the face from one ear to the other.",
        )
    with replacing_folder(capture.cameras) as folder:
        write_model(folder, model)
        report.check()
    images.write_srgb(capture.picture("cameras", "world"), draw_cameras(model, records, capture.frames))
    _findings(solved, records, centres, report)
    registered, azimuth = model.num_reg_images(), coverage.angles(centres)[0]
    for name, value in (
        ("frames_registered", registered),
        ("share_registered", round(registered / len(records), 3)),
        ("reprojection_error_px", round(model.compute_mean_reprojection_error(), 3) if model.num_points3D() else None),
        ("sparse_points", model.num_points3D()),
        ("angular_coverage_deg", round(widest, 1)),
        ("from_person_right_deg", round(float(-azimuth.min()), 1)),
        ("to_person_left_deg", round(float(azimuth.max()), 1)),
        ("landmark_error_px", round(solved.head.error_px, 2)),
        ("focal_px", round(float(np.mean(focal)), 1)),
        ("features", solved.way),
        ("solve_s", round(time.monotonic() - started, 1)),
    ):
        report.figure(name, value)
    report.figure("head_miss_mm", round(1000 * solved.head.unlike_m, 2))
    if solved.swayed:
        report.figure("head_swayed_percent", round(100 * solved.swayed, 1))
    if import_path:
        report.figure("pupils_apart_in_imported_units", round(solved.head.pupils_apart, 5))
    if solved.way == "face":
        report.figure("tracks", solved.tracks)


def _imported(path: Path, frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """Return another program's cameras, checked by the face's landmarks. Raises Problem if they do not fit."""
    model = import_cameras(path, frames, capture.frames, report)
    names = {image.name for image in model.images.values()}
    records = [record for record in frames.records if record.name in names and record.yaw_deg is not None]
    faces = find_landmarks(coverage.spread_evenly(records, MOST_FACES), capture.frames, report)
    width = float(np.median([face.box[2] - face.box[0] for face in faces.values()] or [1.0]))

    def check_head(model) -> tuple[HeadFrame, float]:
        """Return the head, and its largest miss in these cameras as a multiple of what is allowed."""
        head = find_head(model, faces, settings.cameras.interpupillary_mm / 1000)
        return head, max(
            head.miss / IMPORT_MISS_SHARE, head.error_px / width / IMPORT_MISS_SHARE, head.unlike_m / IMPORT_UNLIKE_M
        )

    head, off = check_head(model)
    if 1 <= off < IMPORT_NEAR_RATIO and len(frames.records) <= ALL_PAIRS_FRAMES:
        report.log("The imported cameras are a little off; they are refined by what matches in these pictures.")
        matches = solve_structure(frames, capture, False, settings.cameras.matching, settings.seed, report)[1]
        focal_by_name = {
            image.name: model.cameras[image.camera_id].mean_focal_length() for image in model.images.values()
        }
        model = refine(model, faces, matches, focal_by_name, report, agree=WIDE_WIDTH_SHARES + AGREE_WIDTH_SHARES)
        head, off = check_head(model)
    if not off < 1:
        raise Problem(
            f"The cameras in {path.name} do not fit these pictures: the face's landmarks miss each other by "
            f"{head.error_px:.0f} px "
            f"({100 * head.error_px / width:.0f} % of the face's width), and a head by "
            f"{1000 * head.unlike_m:.0f} mm.",
            "Import the cameras that were solved from these very pictures, not cropped, under the same "
            "names; or empty the setting.",
        )
    return Solved(model, "imported", head, faces)


def _findings(solved: Solved, records: Sequence[FrameRecord], centres: np.ndarray, report: Reporter) -> None:
    """Report what is wrong with a usable capture, and how to shoot it again."""
    shown = {record.name: record.shown for record in records}
    if solved.way == "face" and not solved.every_frame_held and len(records) >= LEAST_VIEWS:
        rough = "refined by what little matches" if solved.refined else "to ten degrees or so"
        report.finding(
            f"The frames do not overlap enough to be matched: the cameras come from the face's landmarks, "
            f"{rough}. Expect a rough head.",
            "Take a photograph every ten degrees around the face, from ear to ear, with a busy background.",
        )
    if solved.stood_still:
        report.finding(
            "The head turned while the camera stood still. The cameras hold for the head, but light and "
            "shadows slide over the face as it turns.",
            "Let the person sit still and walk around them with the camera.",
        )
    elif solved.head_moved:
        report.finding(
            "The head moved against its background during the capture; only what matches on the head itself was used.",
            "Let the person lean the head against a wall or a chair, look at one point, and keep still.",
        )
    if solved.zoomed > 1:
        report.finding(
            f"The lens zoomed slowly while filming, by {100 * (solved.zoomed - 1):.0f} % or more. Each stretch got a "
            "focal length of its own, which makes the cameras less sure.",
            "Film with one lens, without zooming: move the camera instead.",
        )
    changes = expression_changes(solved.face_by_name)
    if len(changes) > 0.1 * len(solved.face_by_name):
        report.finding(
            f"The expression changes: in {len(changes)} of {len(solved.face_by_name)} frames the mouth is opened "
            "or drawn otherwise than in the rest.",
            "Ask for a relaxed face with closed mouth, without talking, until the end.",
            [shown[name] for name in changes],
        )
    if solved.mirrored:
        report.finding(
            f"Mirrored pictures were left out: {', '.join(shown[name] for name in solved.mirrored)}.",
            "Flip them back; on a phone, switch off the mirroring of the front camera.",
            [shown[name] for name in solved.mirrored],
        )
    _left_out(solved, records, shown, report)
    for problem, remedy in coverage.missing(centres):
        report.finding(problem, remedy)


def _left_out(solved: Solved, records: Sequence[FrameRecord], shown_names: dict[str, str], report: Reporter) -> None:
    fits = {image.name for image in solved.model.images.values() if image.has_pose}
    rest = [record for record in records if record.name not in fits and record.name not in solved.mirrored]
    if not rest:
        return
    sharp = np.median([record.sharpness for record in records if record.name in fits])
    photographs = all(record.time_s is None for record in records)
    blurred = sum(record.sharpness < BLURRED_SHARPNESS_SHARE * sharp for record in rest)
    if blurred > len(rest) / 2:
        why = f"; {blurred} of them are blurred"
        remedy = (
            "Take those again, sharp."
            if photographs
            else "Move the camera slower, or add light, so that each frame is sharp."
        )
    else:
        why = ""
        remedy = (
            "Take more between those that fit and those that do not, with the whole head in the picture."
            if photographs
            else "Move the camera slower past the places where frames were lost, and keep the whole head in the "
            "picture."
        )
    report.finding(
        f"{len(rest)} of {len(records)} {'photographs' if photographs else 'frames'} did not fit the others "
        f"and were left out{why}.",
        remedy,
        [shown_names[record.name] for record in rest],
    )
