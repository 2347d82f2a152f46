# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The registered head over the frames, for the eye: its visible edges, and the landmarks it was lifted from."""

from __future__ import annotations

import cv2
import numpy as np

from ..geometry import raster
from ..geometry.meshes import Mesh, vertex_normals
from ..geometry.views import View
from ..imaging import images
from .landmarks import Landmarks


def overlay(views: list[View], mesh: Mesh, found: Landmarks, height: int = 640) -> np.ndarray:
    """sRGB [height, W, 3]: per view the frame with the wireframe and, in yellow, the landmarks that were used."""
    caster, normals = raster.RayCaster(mesh), vertex_normals(mesh)
    edges = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return np.hstack([_one(view, mesh, caster, normals, edges, found, height) for view in views])


def three_views(views: list[View], found: Landmarks) -> list[View]:
    """The leftmost, the middle and the rightmost of the views whose landmarks were used."""
    seen = [view for view in views if view.name in found.images and found.images[view.name][1].any()] or views
    middle = np.nanmean(found.points, axis=0)
    ordered = sorted(seen, key=lambda view: np.arctan2(view.centre[0] - middle[0], middle[1] - view.centre[1]))
    return [ordered[0], ordered[len(ordered) // 2], ordered[-1]]


def _one(view, mesh, caster, normals, edges, found, height):
    srgb = images.read_srgb(view.path)
    scale = height / view.height
    canvas = np.ascontiguousarray(images.resize(srgb, round(view.width * scale), height))
    pixels, _ = view.project(mesh.vertices)
    seen = raster.visible_from(caster, mesh.vertices, normals, view.centre)
    shown = edges[seen[edges].all(1)]
    shift = 4  # cv2 draws with fractional pixels as fixed-point integers
    lines = np.round((pixels[shown] * scale - 0.5) * 2 ** shift).astype(np.int32)
    layer = canvas.copy()
    cv2.polylines(layer, list(lines), False, (0.2, 0.9, 1.0), 1, cv2.LINE_AA, shift)
    canvas = 0.55 * canvas + 0.45 * layer
    marks, used = found.images.get(view.name, (np.zeros((0, 2)), np.zeros(0, bool)))
    for x, y in np.round((marks[used] * scale - 0.5) * 2 ** shift).astype(int):
        cv2.circle(canvas, (int(x), int(y)), 1 << shift, (1.0, 0.85, 0.1), -1, cv2.LINE_AA, shift)
    return canvas
