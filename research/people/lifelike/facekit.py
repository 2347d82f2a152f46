# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ICT-FaceKit's identities as displacements of the built-in head.

Li et al., "Learning formation of physically-based face attributes", 2020; MIT. Nothing of it is part of this project:
the user names a folder with its FaceXModel. The head is laid over its neutral face by the 68 landmarks that it lists,
and takes the displacement of what then lies nearest.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from core.face import template

FACE_AND_HEAD = 11144  # its first vertices; sockets, teeth, eyes and lashes follow
# fmt: off
OURS = (
    162, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454, 389, 71, 63, 105, 66, 107, 336, 296,
    334, 293, 301, 168, 197, 5, 4, 75, 97, 2, 326, 305, 33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380, 61,
    39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87,
)
# fmt: on
"""MediaPipe's counterparts of the 68 landmarks; along the jaw they slide, so that those count for the pose only."""
JAW = 17
NEIGHBOURS = 8


@lru_cache(maxsize=1)
def fields(folder: Path) -> np.ndarray:
    """Return displacements [K, V, 3] in metres of the template's vertices, one for each identity in the folder."""
    model = folder / "FaceXModel"
    neutral = _vertices(model / "generic_neutral_mesh.obj")
    indices = json.loads((model / "vertex_indices.json").read_text(encoding="utf-8"))
    marks = neutral[indices["idx_to_landmark_verts"]]
    mesh = template.load()
    ours = template.landmark_points(mesh)[list(OURS)]
    scale, turn, shift = _similarity(ours, marks)
    aligned = scale * ours[JAW:] @ turn.T + shift
    warp = RBFInterpolator(aligned, marks[JAW:] - aligned, smoothing=1e-3)
    aligned = scale * mesh.vertices @ turn.T + shift
    # centimetres: away from the landmarks the warp knows nothing
    fade = np.exp(-((cKDTree(marks).query(aligned)[0] / 6.0) ** 2))[:, None]
    distance, nearest = cKDTree(neutral[:FACE_AND_HEAD]).query(aligned + fade * warp(aligned), NEIGHBOURS)
    weight = 1 / (distance + 0.05)
    weight /= weight.sum(1, keepdims=True)
    displacements = []
    for path in sorted(model.glob("identity*.obj")):
        offsets = (_vertices(path) - neutral)[nearest]
        displacements.append((weight[..., None] * offsets).sum(1) @ turn / scale)
    return np.stack(displacements)


def _vertices(path: Path) -> np.ndarray:
    lines = path.read_text(encoding="ascii").splitlines()
    return np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)


def _similarity(source: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return scale, rotation [3, 3] and translation [3] of source [N, 3] onto target [N, 3] (Umeyama 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    u, singular_values, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn, scale = u * sign @ vt, float((singular_values * sign).sum() / (a**2).sum())
    return scale, turn, target.mean(0) - scale * turn @ source.mean(0)
