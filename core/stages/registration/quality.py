# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality of a fit: its figures, whether it holds, and the parts of the face missing in the scan."""

from dataclasses import dataclass, replace

import numpy as np

from ...capture.messages import Problem, Reporter
from ...geometry import atlas
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from .alignment import HeadModel
from .correspondence import Scan
from .intersections import flipped, intersecting
from .landmarks import Landmarks

LEAST_FOLLOWED_SHARE, FARTHEST_M = 0.3, 0.004
"""Minimum share of the followed vertices with a partner on the scan, and maximum median distance, to accept a fit."""
MOST_MISS_WIDTH_SHARE = 0.05
"""Maximum miss of the landmarks of a head fitted without a scan, as a share of its width, ears included."""
APART_DEG, WANTED_VIEWS = 25.0, 3
"""Angle between photographs as seen from the head, and number of them, that make more than a draft."""
LEAST_SHARE_OF_PHOTOGRAPHS = 0.6
"""Minimum share of followed vertices for photographs, which show a head without their scan as well: a patchy scan does
not improve it."""
LEAST_SHOWN_SHARE = 0.75  # minimum share of a side of the face that the scan should show


class Unlike(Problem):
    """Head that could not be laid over the scan."""


@dataclass(frozen=True)
class HeadFit:
    """Result of a fit.

    head; aligned, the same before the non-rigid fit; coefficients [K] of the identity; distances [M] in metres of the
    followed vertices to the scan, none without a scan.
    """

    head: Mesh
    aligned: Mesh
    coefficients: np.ndarray
    distances: np.ndarray


def figures(report: Reporter, model: HeadModel, fit: HeadFit, landmarks: Landmarks, follow: np.ndarray) -> None:
    """Report a fit's figures; vertices of follow [V] above 0.5 are drawn to the scan, where there is one."""
    head, distances = fit.head, fit.distances
    valid = np.isfinite(landmarks.points).all(1)
    miss = np.linalg.norm(model.at_landmarks(head.vertices) - landmarks.points, axis=1)
    face = (follow > 0.5)[head.faces].all(1)
    stretched = atlas.stretch(replace(head, faces=head.faces[face], face_uvs=head.face_uvs[face]))
    report.figure("landmark_frames", len(landmarks.images))
    report.figure("landmark_reprojection_px", round(landmarks.error_px, 2))
    report.figure("landmark_residual_mm", round(1e3 * float(np.median(miss[valid])), 2))
    report.figure("landmarks_put_by_hand", int(landmarks.by_artist.sum()))
    if landmarks.by_artist.any():
        report.figure("put_landmark_residual_mm", round(1e3 * float(miss[landmarks.by_artist].max()), 2))
    report.figure("eye_opening", round(landmarks.opening, 2) if np.isfinite(landmarks.opening) else None)
    report.figure("identity_norm", round(float(np.linalg.norm(fit.coefficients)), 2))
    report.figure("head_to_scan_median_mm", round(1e3 * float(np.median(distances)), 3) if len(distances) else None)
    p90 = round(1e3 * float(np.percentile(distances, 90)), 3) if len(distances) else None
    report.figure("head_to_scan_p90_mm", p90)
    report.figure("face_with_scan_percent", round(100 * len(distances) / max(int((follow > 0.5).sum()), 1), 1))
    report.figure("flipped_triangles", int(flipped(fit.aligned, head.vertices).sum()))
    report.figure("intersecting_triangles", len(intersecting(head.vertices, head.faces)))
    report.figure("uv_stretch_p95", round(float(np.percentile(stretched, 95)), 2))


def judge(
    report: Reporter,
    head: Mesh,
    scan: Scan,
    distances: np.ndarray,
    follow: np.ndarray,
    least_share: float = LEAST_FOLLOWED_SHARE,
) -> None:
    """Report the sides of the face that the scan does not show.

    distances [N] in metres are those of the vertices within reach of the scan, follow [V] above 0.5 is the face. Raises
    Unlike if the fit does not hold: fewer than least_share of the face have the scan in reach, or it lies too far away.
    """
    face = follow > 0.5
    if len(distances) < least_share * face.sum():
        raise Unlike(
            f"The head does not fit the scan: only {100 * len(distances) / face.sum():.0f} % of the face was scanned.",
            "Check the scan's picture in the report. Film more slowly, from ear to ear, with the whole face in view.",
        )
    if np.median(distances) > FARTHEST_M:
        raise Unlike(
            f"The head does not fit the scan: it stays {1e3 * np.median(distances):.0f} mm away from it.",
            "Check the scan's picture in the report. If it shows no face, film again with the head still "
            "and hair and hands off the face.",
        )
    signed, _ = scan.match(head.vertices, vertex_normals(head), 0.01)
    for name, where in _sides(head, face).items():
        share = float(np.isfinite(signed[where]).mean())
        if share < LEAST_SHOWN_SHARE:
            report.finding(
                f"The scan shows only {100 * share:.0f} % of {name}; the rest comes from the average shape of heads.",
                f"Film again with {name} well in view, in sharp frames.",
            )


def report_views(report: Reporter, fitted, views: list[View], head: Mesh) -> None:
    """Report figures of an unscanned.FittedHead."""
    for name, count in fitted.used.items():
        report.figure(f"constraints_by_{name}", count)
        report.figure(f"miss_of_{name}_mm", round(1e3 * fitted.miss_m[name], 2) if count else None)
    report.figure("views_apart", views_apart(views, head))


def judge_views(head: Mesh, fitted) -> None:
    """Refuse a head that does not fit the views.

    Raises Problem.
    """
    x = head.vertices[:, 0]
    if not fitted.miss_m["landmarks"] < MOST_MISS_WIDTH_SHARE * np.ptp(x):
        raise Problem(
            f"The head does not fit these pictures: facial features are {1e3 * fitted.miss_m['landmarks']:.0f} mm off.",
            "Use pictures of one still face, neither cropped nor mirrored, or import cameras from another program.",
        )


def tell_draft(report: Reporter, views: list[View], head: Mesh) -> None:
    """Report a finding if pictures show too few sides of a head to make more than a draft."""
    apart = views_apart(views, head)
    if apart < WANTED_VIEWS:
        sides = "one side" if apart < 2 else f"{apart} sides that are at least {APART_DEG:.0f} degrees apart"
        report.finding(
            f"This head is a draft: its pictures show the face from {sides} only, so its depth is mostly a guess.",
            "For a likeness, show the face at least from the front and from about 40 degrees on each side.",
        )


def views_apart(views: list[View], head: Mesh) -> int:
    """Return the number of views of which every two are at least APART_DEG apart as seen from the head."""
    towards = unit(np.stack([view.centre for view in views]) - head.vertices.mean(0))
    near = np.degrees(np.arccos(np.clip(towards @ towards.T, -1, 1))) < APART_DEG
    best = 0
    for first in range(len(views)):  # finding the largest set is hard; greedy from every view is close enough
        free, count = np.ones(len(views), bool), 0
        order = [first, *np.argsort(near.sum(1))]
        for i in order:
            if free[i]:
                count += 1
                free &= ~near[i]
        best = max(best, count)
    return best


def _sides(head: Mesh, face_vertices: np.ndarray) -> dict[str, np.ndarray]:
    """Return parts of the face as the person has them, bool [V] each."""
    x, _, z = head.vertices.T
    middle, low, high = np.median(x[face_vertices]), *np.percentile(z[face_vertices], [15, 85])
    return {
        "the right side of the face": face_vertices & (x < middle - 0.02),
        "the left side of the face": face_vertices & (x > middle + 0.02),
        "the chin": face_vertices & (z < low),
        "the forehead": face_vertices & (z > high),
    }
