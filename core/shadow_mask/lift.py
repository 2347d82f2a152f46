# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows that the delighter saw in the frames, carried to the texture (paper, appendix "Shadow Detection")."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import images
from ..capture import Capture
from ..meshes import Mesh, vertex_normals
from ..messages import Reporter
from ..raster import RayCaster, interpolate, sample, visible_from
from ..views import read_views


def lift_shadows(capture: Capture, mesh: Mesh, face: np.ndarray, bary: np.ndarray, report: Reporter) -> np.ndarray:
    """Mean over the views that see a texel of delit/shadow/NNNNN.png: [S, S] in [0, 1] for a UV raster (face, bary) of the mesh; 0 where there is none."""
    views = [(view, path) for view in read_views(capture) if (path := (capture.delit / "shadow" / view.name).with_suffix(".png")).is_file()]
    texels = np.flatnonzero(face.ravel() >= 0)
    points, normals = (interpolate(values, mesh.faces, face, bary).reshape(-1, 3)[texels] for values in (mesh.vertices, vertex_normals(mesh)))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    caster = RayCaster(mesh)
    total, weight = np.zeros(len(texels)), np.zeros(len(texels))
    for i, (view, path) in enumerate(views):
        report.progress(i, len(views) + 3, "Lifting the frames' shadows")
        towards = view.centre - points
        cosine = (towards * normals).sum(1) / np.linalg.norm(towards, axis=1)
        pixels, _ = view.project(points)
        seen = np.flatnonzero((cosine > 0.2) & ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1))
        seen = seen[visible_from(caster, points[seen], normals[seen], view.centre)]
        trust = cosine[seen] ** 2
        total[seen] += trust * sample(images.read_mask(Path(path)), pixels[seen])
        weight[seen] += trust
    lifted = np.zeros(face.size, np.float32)
    lifted[texels] = total / np.maximum(weight, 1e-6)
    return lifted.reshape(face.shape)
