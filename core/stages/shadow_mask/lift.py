# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows seen in the frames, carried to the texture (paper, appendix "Shadow Detection"): each texel is judged by the
views that see it well."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.raster import sample, silhouette_distance, visible_from
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
            sample(silhouette_distance(head.caster, view, 0.25, 12), pixels[seen])
            / (EDGE_SIDE_SHARE * max(view.width, view.height)),
            0.02,
            1,
        )
        trust = cosine[seen] ** 2 * inner
        total[seen] += trust * sample(mask, pixels[seen])
        weight[seen] += trust
    return head.spread(total / np.maximum(weight, 1e-6))
