# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Height over the template's surface to a tangent-space normal map."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas


def normals(height: np.ndarray, on: Canvas) -> np.ndarray:
    """Return unit normals float32 [N, 3] (x along +u, y along +v: OpenGL) of a height [N] in mm over the surface.

    The slope is measured along the surface through the UV's metric, with one-sided differences at the charts' borders.
    """
    picture = np.zeros((on.size, on.size), np.float32)
    picture[on.covered] = height
    along_u = _difference(picture, on.covered, 1)[on.covered]
    along_v = -_difference(picture, on.covered, 0)[on.covered]  # rows run against v
    a, b, c = on.metric.T
    x = along_u / np.maximum(a, 1e-6)
    y = (along_v - b * x) / np.maximum(c, 1e-6)
    normal = np.stack([-x, -y, np.ones_like(x)], -1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _difference(picture: np.ndarray, covered: np.ndarray, axis: int) -> np.ndarray:
    """Change per texel towards higher indices, from the covered neighbours only."""
    total, steps = np.zeros_like(picture), np.zeros_like(picture)
    low = tuple(slice(None, -1) if i == axis else slice(None) for i in range(2))
    high = tuple(slice(1, None) if i == axis else slice(None) for i in range(2))
    both = covered[low] & covered[high]
    change = np.where(both, picture[high] - picture[low], 0)
    for side in (low, high):
        total[side] += change
        steps[side] += both
    return total / np.maximum(steps, 1)
