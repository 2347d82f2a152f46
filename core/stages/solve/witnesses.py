# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Confirm marks by the views: what one view alone shows (a highlight's gap, an eyelash) is not the skin's."""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.capture import Capture
from ...face.head import Head
from ...geometry import raster
from ...geometry.frame_pictures import delit_views
from ...geometry.views import View
from ...imaging import images
from ...solver.extensions.marks import Mark

MIN_FACING_COSINE = 0.35  # least cosine between the surface and the way to the camera
MIN_SHOWN_SHARE = 0.4  # of the texture's contrast that a view must show
MIN_AGREED_SHARE = 0.6  # share of the views that see the place
MIN_VIEWS = 2  # views; where fewer saw it the texture alone decides


def confirm_marks(capture: Capture, head: Head, marks: list[Mark], size: int) -> list[Mark]:
    """Return the marks of a map of `size` texels that the delit views agree on; all of them without views."""
    if not marks or not capture.frames_json.is_file() or not capture.cameras.is_dir():
        return marks
    covered = head.raster(size)[0] >= 0
    points, normals = (head.interpolate(vectors, size) for vectors in (head.mesh.vertices, head.normals))
    at = tuple(np.round([[mark.row, mark.column] for mark in marks]).astype(int).clip(0, size - 1).T)
    unit = normals[at] / np.maximum(np.linalg.norm(normals[at], axis=1, keepdims=True), 1e-9)
    views, agreeing = np.zeros(len(marks), int), np.zeros(len(marks), int)
    for view, path in delit_views(capture):
        shown = find_visible(view, head.caster, points[at], unit) & covered[at]
        if not shown.any():
            continue
        picture = np.log(np.maximum(images.read_linear(path), 1e-3)).mean(-1)
        for k in np.flatnonzero(shown):
            contrast = _contrast(view, picture, points, covered, marks[k])
            views[k] += contrast is not None
            agreeing[k] += contrast is not None and contrast > MIN_SHOWN_SHARE * marks[k].contrast
    confirmed = (views < MIN_VIEWS) | (agreeing >= MIN_AGREED_SHARE * views)
    return [mark for mark, keep in zip(marks, confirmed, strict=True) if keep]


def find_visible(view: View, caster: raster.RayCaster, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return bool [N]: points [N, 3] in metres with unit normals [N, 3] of the caster's surface that a view sees."""
    towards = view.centre - points
    facing = (towards * normals).sum(1) > MIN_FACING_COSINE * np.linalg.norm(towards, axis=1)
    pixels, _ = view.project(points)
    inside = ((pixels > 2) & (pixels < [view.width - 2, view.height - 2])).all(1)
    return facing & inside & raster.visible_from(caster, points, normals, view.centre)


def _contrast(view: View, picture: np.ndarray, points: np.ndarray, covered: np.ndarray, mark: Mark) -> float | None:
    """Return how much darker a view (log [H, W]) is at a mark than around it; None if its frame ends there."""
    reach = int(np.ceil(3.5 * mark.radius + 1))
    row, column = round(mark.row), round(mark.column)
    window = slice(max(row - reach, 0), row + reach + 1), slice(max(column - reach, 0), column + reach + 1)
    if not covered[window].all():
        return None
    pixels, _ = view.project(points[window].reshape(-1, 3))
    if not np.isfinite(pixels).all() or (pixels < 0).any() or (pixels > [view.width, view.height]).any():
        return None
    patch = raster.sample(picture, pixels).reshape(covered[window].shape).astype(np.float32)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    distance = np.hypot(x, y)
    disc = (distance <= max(0.7 * mark.radius, 0.5)).astype(np.float32)
    ring = ((distance > 1.5 * mark.radius + 0.5) & (distance <= 2.5 * mark.radius + 1)).astype(np.float32)
    kernel = ring / ring.sum() - disc / disc.sum()
    darker = cv2.filter2D(patch, -1, kernel, borderType=cv2.BORDER_REFLECT)
    middle = np.array(patch.shape) // 2
    near = max(1, round(mark.radius))
    return float(darker[middle[0] - near : middle[0] + near + 1, middle[1] - near : middle[1] + near + 1].max())
