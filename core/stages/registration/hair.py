# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of the head and clothes, told from skin by the face parser: no skull is fitted to them."""

from __future__ import annotations

import numpy as np

from ...capture.messages import Reporter
from ...face import parser, template
from ...geometry import raster
from ...geometry.meshes import Mesh, vertex_normals
from ...geometry.views import View
from .landmarks import spread

MOST_VIEWS = 12
"""That are parsed, spread over all: the network takes its time over each."""
FACING_COSINE = 0.4
"""Least cosine between a surface and the way to the camera."""
HAIR_SHARE = 0.5
"""Share of the views that face a point and show it as hair or cloth, from which it is."""
LEAST_LEFT_SHARE = 0.2
"""Share of a scan that must be left: less is a picture that the parser does not understand."""


def without_hair(scan: Mesh, views: list[View], head: Mesh, report: Reporter) -> Mesh:
    """The scan without the triangles of hair and cloth.

    Parameters
    ----------
    scan : in metres
    views : with their pictures
    head : the template, placed roughly, by which the pictures are cut
    report : takes the share that goes
    """
    normals, caster = vertex_normals(scan), raster.RayCaster(scan)
    share = hidden_share(
        scan.vertices,
        normals,
        views,
        head,
        report,
        lambda view: raster.visible_from(caster, scan.vertices, normals, view.centre, offset=0.002),
    )
    hidden = np.nan_to_num(share) > HAIR_SHARE
    kept = ~hidden[scan.faces].any(1)
    report.figure("hair_in_scan_percent", round(100 * float(1 - kept.mean()), 1))
    return Mesh(scan.vertices, scan.faces[kept]) if LEAST_LEFT_SHARE < kept.mean() < 1 else scan


def hidden_share(
    points: np.ndarray, normals: np.ndarray, views: list[View], head: Mesh, report: Reporter, visible=None
) -> np.ndarray:
    """The mean share of hair and cloth before points, over the views that face them.

    Parameters
    ----------
    points : [N, 3], in metres
    normals : [N, 3], unit
    views : with their pictures
    head : whose landmarks frame the parser's crop
    report : hears whether it is cancelled
    visible : view -> bool [N], whether it sees the points; None: all that face it

    Returns
    -------
    [N] in [0, 1]; nan where no view tells.
    """
    marks = template.landmark_points(head)
    total, votes = np.zeros(len(points)), np.zeros(len(points))
    for view in spread(views, MOST_VIEWS):
        report.check()
        pixels, _ = view.project(marks)
        if not view.path.is_file() or not np.isfinite(pixels).all():
            continue
        srgb = view.read()
        scale = np.array([srgb.shape[1] / view.width, srgb.shape[0] / view.height])
        parts = parser.parse(srgb, pixels * scale)
        at, depth = view.project(points)
        towards = view.centre - points
        facing = (towards * normals).sum(1) > FACING_COSINE * np.linalg.norm(towards, axis=1)
        there = facing & (depth > 0) & (at > 0).all(1) & (at < [view.width, view.height]).all(1)
        if visible is not None:
            there &= visible(view)
        known, share = (raster.sample(mask, at[there] * scale) for mask in (parts.known(), parts.of("hair", "clothes")))
        total[there] += known
        votes[there] += known * share
    return np.where(total > 0.5, votes / np.maximum(total, 1e-9), np.nan)
