# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How good a fit is: its figures, whether it holds, and what part of the face the scan does not show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...capture.messages import Problem, Reporter
from ...geometry import atlas
from ...geometry.meshes import Mesh, vertex_normals
from ...geometry.views import View
from .alignment import HeadModel
from .correspondence import Scan
from .intersections import flipped, intersecting
from .landmarks import Landmarks

LEAST_FOLLOWED_SHARE, FARTHEST_M = 0.3, 0.004
"""A fit holds when this share of the followed vertices finds a partner on the scan, at this distance or nearer in the
median."""
MOST_MISS_WIDTH_SHARE = 0.05
"""Share of the head's width, ears and all, by which landmarks may miss one that is fitted without a scan."""
APART_DEG, WANTED_VIEWS = 25.0, 3
"""So many photographs, so far apart as seen from the head, make a head; fewer a draft."""
LEAST_SHARE_OF_PHOTOGRAPHS = 0.6
"""The same for photographs, which show a head without their scan as well: patches of one do not lay it better."""
LEAST_SHOWN_SHARE = 0.75
"""Share of a side of the face that the scan should show."""


class Unlike(Problem):
    """A head that could not be laid over the scan."""


@dataclass(frozen=True)
class HeadFit:
    """What a fit came to: head; aligned, the same before the non-rigid fit; coefficients [K] of the identity; distances
    [M] in metres of the vertices that are followed to the scan, none where there is no scan."""

    head: Mesh
    aligned: Mesh
    coefficients: np.ndarray
    distances: np.ndarray


def figures(report: Reporter, model: HeadModel, fit: HeadFit, landmarks: Landmarks, follow: np.ndarray) -> None:
    """Reports a fit's figures.

    Parameters
    ----------
    report : takes them
    model : the template
    fit : to the scan or the views
    landmarks : that were fitted
    follow : [V] in [0, 1]; vertices above 0.5 are drawn to the scan, where there is one
    """
    head, distances = fit.head, fit.distances
    known = np.isfinite(landmarks.points).all(1)
    miss = np.linalg.norm(model.at_landmarks(head.vertices) - landmarks.points, axis=1)
    face = (follow > 0.5)[head.faces].all(1)
    stretched = atlas.stretch(replace(head, faces=head.faces[face], face_uvs=head.face_uvs[face]))
    report.figure("landmark_frames", len(landmarks.images))
    report.figure("landmark_reprojection_px", round(landmarks.error_px, 2))
    report.figure("landmark_residual_mm", round(1e3 * float(np.median(miss[known])), 2))
    report.figure("landmarks_put_by_hand", int(landmarks.by_artist.sum()))
    if landmarks.by_artist.any():
        report.figure("put_landmark_residual_mm", round(1e3 * float(miss[landmarks.by_artist].max()), 2))
    report.figure("eye_opening", round(landmarks.opening, 2) if np.isfinite(landmarks.opening) else None)
    report.figure("identity_norm", round(float(np.linalg.norm(fit.coefficients)), 2))
    report.figure("head_to_scan_median_mm", round(1e3 * float(np.median(distances)), 3) if len(distances) else None)
    report.figure(
        "head_to_scan_p90_mm", round(1e3 * float(np.percentile(distances, 90)), 3) if len(distances) else None
    )
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
    """Whether the fit holds; the report is told which side of the face the scan does not show.

    Parameters
    ----------
    report : takes the findings
    head : as fitted, in metres
    scan : that it was fitted to
    distances : [N], metres from the scan, of the vertices that have it in reach
    follow : [V] in [0, 1], above 0.5 the face
    least_share : of the face that must have the scan in reach

    Raises
    ------
    Unlike
        Where the fit does not hold.
    """
    wanted = follow > 0.5
    if len(distances) < least_share * wanted.sum():
        raise Unlike(
            f"The head could not be laid over the scan of the face: only "
            f"{100 * len(distances) / wanted.sum():.0f} % of the face is in the scan.",
            "Look at the scan's picture in the report; film again slower, in an arc from ear to ear, with "
            "the whole face in view.",
        )
    if np.median(distances) > FARTHEST_M:
        raise Unlike(
            f"The head could not be laid over the scan of the face: it stays {1e3 * np.median(distances):.0f} "
            "mm away from it.",
            "Look at the scan's picture in the report: where it is no face, film again with the head kept "
            "still and hair and hands off the face.",
        )
    signed, _ = scan.match(head.vertices, vertex_normals(head), 0.01)
    for name, where in _sides(head, wanted).items():
        shown = float(np.isfinite(signed[where]).mean())
        if shown < LEAST_SHOWN_SHARE:
            report.finding(
                f"The scan shows only {100 * shown:.0f} % of {name}; the rest was guessed from the shape of heads.",
                f"Film once more and bring {name} well into view, in sharp frames.",
            )


def report_views(report: Reporter, fitted, views: list[View], head: Mesh) -> None:
    """Figures of a fit to what the views show.

    Parameters
    ----------
    report : takes them
    fitted : unscanned.FittedHead
    views : that it was fitted to
    head : as fitted, in metres
    """
    for name, count in fitted.used.items():
        report.figure(f"constraints_by_{name}", count)
        report.figure(f"miss_of_{name}_mm", round(1e3 * fitted.miss_m[name], 2) if count else None)
    report.figure("views_apart", views_apart(views, head))


def judge_views(head: Mesh, fitted) -> None:
    """Raises Problem where a head does not fit what the views show."""
    x = head.vertices[:, 0]
    if not fitted.miss_m["landmarks"] < MOST_MISS_WIDTH_SHARE * np.ptp(x):
        raise Problem(
            f"The head could not be laid over the face in these pictures: its features miss by "
            f"{1e3 * fitted.miss_m['landmarks']:.0f} mm.",
            "Use pictures of one still face, neither cropped nor mirrored; or import cameras that another "
            "program has solved.",
        )


def tell_draft(report: Reporter, views: list[View], head: Mesh) -> None:
    """Tells where pictures show too few sides of a head to make more than a draft."""
    apart = views_apart(views, head)
    if apart < WANTED_VIEWS:
        sides = "one side" if apart < 2 else f"{apart} sides that are at least {APART_DEG:.0f} degrees apart"
        report.finding(
            f"This head is a draft: its pictures show the face from {sides} only, and its depth is mostly guessed.",
            "Show the face from the front and from each side, about 40 degrees around: these are the least "
            "for a likeness.",
        )


def views_apart(views: list[View], head: Mesh) -> int:
    """How many views there are of which every two are at least APART_DEG apart as seen from the head."""
    towards = np.stack([view.centre for view in views]) - head.vertices.mean(0)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    near = np.degrees(np.arccos(np.clip(towards @ towards.T, -1, 1))) < APART_DEG
    best = 0
    for first in range(len(views)):  # the largest set is hard to find; greedy from every view is near enough
        left, count = np.ones(len(views), bool), 0
        order = [first, *np.argsort(near.sum(1))]
        for i in order:
            if left[i]:
                count += 1
                left &= ~near[i]
        best = max(best, count)
    return best


def _sides(head: Mesh, face_vertices: np.ndarray) -> dict[str, np.ndarray]:
    """Parts of the face as the person has them: bool [V] each."""
    x, _, z = head.vertices.T
    middle, low, high = np.median(x[face_vertices]), *np.percentile(z[face_vertices], [15, 85])
    return {
        "the right side of the face": face_vertices & (x < middle - 0.02),
        "the left side of the face": face_vertices & (x > middle + 0.02),
        "the chin": face_vertices & (z < low),
        "the forehead": face_vertices & (z > high),
    }
