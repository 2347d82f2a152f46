# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Correspondence of template and scan: the nearest compatible patch, with robust weights."""

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.meshes import Mesh, unit, vertex_normals

NEIGHBOURS = 8  # samples of the scan in a patch
MOST_ANGLE_DEG = 45.0  # maximum angle between the normals of partners


class Scan:
    """Scan as points with normals, ready to be searched."""

    def __init__(self, mesh: Mesh):
        used = np.unique(mesh.faces)
        self.points = mesh.vertices[used]
        self.normals = vertex_normals(mesh)[used]
        self._tree = cKDTree(self.points)
        spacing = self._tree.query(self.points[:: max(1, len(used) // 2000)], 2)[0][:, 1]
        self.spacing = float(np.median(spacing))

    def match(self, points: np.ndarray, normals: np.ndarray, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return signed distances [N] along the scan's local normals, and those normals [N, 3].

        nan where nothing compatible lies within `farthest` metres. A local patch (the mean of the nearest scan points,
        nearer ones counting more) takes out the scan's noise.
        """
        distance, index = self._tree.query(points, NEIGHBOURS, distance_upper_bound=farthest, workers=-1)
        in_reach = np.isfinite(distance)
        distance, index = np.where(in_reach, distance, 0), np.where(in_reach, index, 0)
        near = in_reach * np.exp(-0.5 * ((distance - distance[:, :1]) / (1.5 * self.spacing)) ** 2)
        total = np.maximum(near.sum(1, keepdims=True), 1e-12)
        centre = (self.points[index] * near[..., None]).sum(1) / total
        normal = unit((self.normals[index] * near[..., None]).sum(1) / total)
        compatible = in_reach[:, 0] & ((normal * normals).sum(1) > np.cos(np.radians(MOST_ANGLE_DEG)))
        sideways = np.linalg.norm(points - centre - ((points - centre) * normal).sum(1, keepdims=True) * normal, axis=1)
        compatible &= sideways < 3 * self.spacing  # beyond: past the rim of a hole
        signed = ((centre - points) * normal).sum(1)
        return np.where(compatible, signed, np.nan), normal

    def distances(self, points: np.ndarray, normals: np.ndarray, farthest: float = 0.02) -> np.ndarray:
        """Return unsigned point-to-plane distances [M] in metres of the points that find a partner."""
        signed, _ = self.match(points, normals, farthest)
        return np.abs(signed[np.isfinite(signed)])


def biweight(signed: np.ndarray, least: float) -> np.ndarray:
    """Return Tukey's biweight [N] of signed distances, 0 for nan.

    Zero beyond three robust deviations, or `least` metres if that is more.
    """
    valid = np.isfinite(signed)
    if not valid.any():
        return np.zeros(len(signed))
    width = max(3 * 1.4826 * np.median(np.abs(signed[valid])), least)
    return np.where(valid, np.clip(1 - (np.nan_to_num(signed) / width) ** 2, 0, 1) ** 2, 0)
