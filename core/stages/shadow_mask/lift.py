# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows seen in the frames, carried to the texture (paper, appendix "Shadow Detection"): each texel is judged by the
views that see it well."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.raster import RayCaster, render_view, sample, visible_from
from ...geometry.views import View

GRAZING_COSINE = 0.2  # cosine of the steepest angle under which a texel is judged
# of the frame's longer side: so near a silhouette a small error of the head shows what lies behind
EDGE_SIDE_SHARE = 0.012


def lift_shadows(head: Unfolded, count: int, masks: Iterable[tuple[View, np.ndarray]], report: Reporter) -> np.ndarray:
    """The views' shadow masks on the head. A view's vote counts less where it sees the surface at a glancing angle or
    near a silhouette.

    Parameters
    ----------
    head : unfolded
    count : of the views
    masks : each view with its mask [H, W] in [0, 1]
    report : hears of progress

    Returns
    -------
    [S, S] in [0, 1]: the share of the votes for shadow, 0 where nobody votes.
    """
    total, weight = np.zeros(len(head.points)), np.zeros(len(head.points))
    for i, (view, mask) in enumerate(masks):
        report.progress(count + 2 * i, 4 * count, "Lifting the frames' shadows")
        towards = view.centre - head.points
        cosine = (towards * head.normals).sum(1) / np.linalg.norm(towards, axis=1)
        pixels, _ = view.project(head.points)
        seen = np.flatnonzero(
            (cosine > GRAZING_COSINE) & ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)
        )
        seen = seen[visible_from(head.caster, head.points[seen], head.normals[seen], view.centre)]
        inner = np.clip(
            sample(_silhouette_distance(head.caster, view), pixels[seen])
            / (EDGE_SIDE_SHARE * max(view.width, view.height)),
            0.02,
            1,
        )
        trust = cosine[seen] ** 2 * inner
        total[seen] += trust * sample(mask, pixels[seen])
        weight[seen] += trust
    return head.spread(total / np.maximum(weight, 1e-6))


def _silhouette_distance(caster: RayCaster, view: View, scale: float = 0.25) -> np.ndarray:
    """[H, W]: pixels to where the head ends or a nearer part of it hides a farther one."""
    _, _, distance = render_view(caster, view, scale)
    depth = np.where(np.isfinite(distance), distance, 1e3).astype(np.float32)
    footprint = 1 / (scale * view.camera.mean_focal_length())  # metres across a pixel, per metre of distance
    jump = cv2.morphologyEx(depth, cv2.MORPH_GRADIENT, np.ones((3, 3))) > 12 * footprint * depth
    away = cv2.distanceTransform((~jump).astype(np.uint8), cv2.DIST_L2, 5) / scale
    return cv2.resize(away, (view.width, view.height), interpolation=cv2.INTER_LINEAR)
