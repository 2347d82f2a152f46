# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of the head and clothes, told from skin by the face parser: no skull is fitted to them."""

import numpy as np

from ...capture.messages import Reporter
from ...face import parser, template
from ...geometry import raster
from ...geometry.meshes import Mesh, vertex_normals
from ...geometry.views import View
from .landmarks import spread

MOST_VIEWS = 12  # maximum number of views to parse, spread over all: the network is slow
FACING_COSINE = 0.4  # minimum cosine between a surface and the direction to the camera
HAIR_SHARE = 0.5  # share of the views facing a point that must show it as hair or cloth
LEAST_SKIN_SHARE = 0.2  # minimum share of a scan to keep: less is a picture that the parser does not understand


def without_hair(scan: Mesh, views: list[View], head: Mesh, report: Reporter) -> Mesh:
    """Return the scan without triangles of hair and cloth.

    head is the template, placed roughly: its landmarks frame the parser's crops.
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
    skin = ~hidden[scan.faces].any(1)
    report.figure("hair_in_scan_percent", round(100 * float(1 - skin.mean()), 1))
    return Mesh(scan.vertices, scan.faces[skin]) if LEAST_SKIN_SHARE < skin.mean() < 1 else scan


def hidden_share(
    points: np.ndarray, normals: np.ndarray, views: list[View], head: Mesh, report: Reporter, visible=None
) -> np.ndarray:
    """Return the mean share [N] in [0, 1] of hair and cloth before points [N, 3], over the views that face them.

    nan where no view shows a point. normals [N, 3] are unit, head's landmarks frame the parser's crop, and
    visible(view) gives bool [N], which points a view sees; None: all that face it.
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
        in_view = facing & (depth > 0) & (at > 0).all(1) & (at < [view.width, view.height]).all(1)
        if visible is not None:
            in_view &= visible(view)
        parsed, share = (
            raster.sample(mask, at[in_view] * scale) for mask in (parts.known(), parts.of("hair", "clothes"))
        )
        total[in_view] += parsed
        votes[in_view] += parsed * share
    return np.where(total > 0.5, votes / np.maximum(total, 1e-9), np.nan)
