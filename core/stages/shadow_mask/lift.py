# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows in the frames, lifted to the texture (paper, appendix "Shadow Detection") by the views that see it well."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.raster import sample
from ...geometry.views import View
from ...geometry.visibility import points_in_view, silhouette_distance

GRAZING_COSINE = 0.2  # cosine of the steepest viewing angle that counts
EDGE_SIDE_SHARE = 0.012  # distance to a silhouette from which a view counts in full, of the frame's longer side


def lift_shadows(head: Unfolded, count: int, masks: Iterable[tuple[View, np.ndarray]], report: Reporter) -> np.ndarray:
    """Return the share of the views' votes for shadow, [S, S] in [0, 1], 0 where none votes.

    Masks are [H, W] in [0, 1], `count` in all. A vote counts less at grazing angles and near silhouettes.
    """
    total, weight = np.zeros(len(head.points)), np.zeros(len(head.points))
    for i, (view, mask) in enumerate(masks):
        report.progress(count + 2 * i, 4 * count, "Lifting the frames' shadows")
        visible, cosine, pixels = points_in_view(head.caster, view, head.points, head.normals, GRAZING_COSINE)
        away = sample(silhouette_distance(head.caster, view, scale=0.25, slope=12), pixels[visible])
        trust = cosine[visible] ** 2 * np.clip(away / (EDGE_SIDE_SHARE * max(view.width, view.height)), 0.02, 1)
        total[visible] += trust * sample(mask, pixels[visible])
        weight[visible] += trust
    return head.spread(total / np.maximum(weight, 1e-6))
