# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of surface points in a view and from the sun, and their distance to silhouettes."""

from __future__ import annotations

import cv2
import numpy as np

from .raster import RayCaster, render_view, visible_from
from .views import View, lengths

OFF_M = 1e-3  # distance at which rays towards the sun start off the surface


def points_in_view(
    caster: RayCaster, view: View, points: np.ndarray, normals: np.ndarray, grazing_cosine: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the indices [M] of the surface points [N, 3] that a view sees less steeply than at `grazing_cosine`.

    With them, for all points, the cosine [N] of the viewing angle and the pixels [N, 2] (nan behind the camera).
    """
    towards = view.centre - points
    cosine = (towards * normals).sum(1) / lengths(towards)
    pixels, _ = view.project(points)
    inside = ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)  # nan is not
    seen = np.flatnonzero(inside & (cosine > grazing_cosine))
    return seen[visible_from(caster, points[seen], normals[seen], view.centre)], cosine, pixels


def reached_by_sun(caster: RayCaster, points: np.ndarray, normals: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """Return bool [N], True for surface points [N, 3] that face the direction [3] with nothing in between."""
    reached = normals @ sun > 0
    origins = points[reached] + OFF_M * normals[reached]
    reached[reached] = ~caster.blocked(origins, np.repeat(sun[None], len(origins), 0))
    return reached


def silhouette_distance(caster: RayCaster, view: View, scale: float, slope: float) -> np.ndarray:
    """Return the distance [H, W] in pixels to where the mesh ends or a nearer part of it hides a farther one.

    Depths are rendered at `scale` of the view's size; they jump where neighbours differ by more than `slope` times what
    a pixel spans at their distance.
    """
    _, _, distance = render_view(caster, view, scale)
    depth = np.where(np.isfinite(distance), distance, 1e3)
    footprint = 1 / (scale * view.camera.mean_focal_length())  # metres across a pixel, per metre of distance
    jump = cv2.morphologyEx(depth.astype(np.float32), cv2.MORPH_GRADIENT, np.ones((3, 3))) > slope * footprint * depth
    to_jump = cv2.distanceTransform((~jump).astype(np.uint8), cv2.DIST_L2, 5) / scale
    return cv2.resize(to_jump, (view.width, view.height), interpolation=cv2.INTER_LINEAR)
