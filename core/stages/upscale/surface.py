# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface of the head under its maps: the place of each texel, and smooth fields over it.

Fields that are computed at points of the surface, by its distances, do not depend on the UV layout: where the map is
cut open, its two edges meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ...geometry import raster, surfaces
from ...geometry.meshes import Mesh, vertex_normals

STRIP_ROWS = 128  # whose triangles are found between two checks for a cancel
# over which a field falls back to its mean where nothing is known: one odd texel on the border must not colour the back
# of the head
FAR_MM = 25.0


@dataclass(frozen=True)
class HeadSurface:
    """Surface of a head, mesh in mm, under maps of a size S: each texel's triangle (-1: none) and bary [S, S(, 3)]."""

    mesh: Mesh
    size: int
    face: np.ndarray
    bary: np.ndarray

    @property
    def covered(self) -> np.ndarray:
        """Texels of the head, bool [S, S]."""
        return self.face >= 0

    @cached_property
    def position(self) -> np.ndarray:
        """Places in mm, float32 [S, S, 3]; beyond the charts the nearest texel's."""
        return self.spread(self.mesh.vertices)

    @cached_property
    def texel(self) -> np.ndarray:
        """Width of each texel in mm, float32 [S, S]."""
        uvs = self.mesh.uvs[self.mesh.face_uvs] * self.size
        first, second = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
        flat = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
        width = np.sqrt(self._doubled_areas / np.maximum(flat, 1e-3 * np.median(flat)))
        return width.astype(np.float32)[np.maximum(self.face, 0)]

    def frames(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit tangent and bitangent [N, 3] at the texels of bool [S, S], as in normal maps."""
        tangent, hand = surfaces.tangents(self.mesh)
        face = np.maximum(self.face, 0)[mask]
        return surfaces.frames(vertex_normals(self.mesh), self.mesh.faces, tangent, hand, face, self.bary[mask])[:2]

    def spread(self, vertex_values: np.ndarray) -> np.ndarray:
        """Return values of the vertices [V, C] as a map, float32 [S, S, C]."""
        return raster.bleed(
            raster.interpolate(vertex_values, self.mesh.faces, self.face, self.bary).astype(np.float32), self.covered
        )

    def smooth(self, field: np.ndarray, weight: np.ndarray, reach: float, tolerance: float | None = None) -> np.ndarray:
        """Return the map, float32 [S, S, C], that follows a field [S, S, C] under its weight [S, S], and is else even.

        It minimises the integral of weight (x - field)^2 + reach^2 |grad x|^2 over the surface, with a weak pull to the
        mean where there is no weight; `reach` is in mm. Values that lie by more than about `tolerance` off a broader
        field lose their weight (Cauchy's).
        """
        means, weight = self._on_vertices(field, weight * self.texel**2)
        trusted = weight
        for _ in range(0 if tolerance is None else 3):
            off = np.abs(means - self._solve(means, trusted, 4 * reach)).mean(1)
            trusted = weight / (1 + (off / tolerance) ** 2)
        return self.spread(self._solve(means, trusted, reach))

    def _on_vertices(self, field: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted means [V, C] of texels around each vertex and the weight's mean there [V]."""
        there = self.covered & (weight > 0)
        corners, count = self.mesh.faces[self.face[there]].ravel(), len(self.mesh.vertices)
        share = (self.bary[there] * weight[there][:, None]).ravel()
        total = np.bincount(corners, share, count)
        sums = [np.bincount(corners, share * np.repeat(channel, 3), count) for channel in field[there].T]
        return np.stack(sums, 1) / np.maximum(total, 1e-12)[:, None], np.minimum(total, self._areas)

    def _solve(self, means: np.ndarray, weight: np.ndarray, reach: float) -> np.ndarray:
        """Return the field's values [V, C]."""
        middle = (means * weight[:, None]).sum(0) / max(weight.sum(), 1e-12)
        pull = (reach / FAR_MM) ** 2 * np.maximum(self._areas, 1e-6)
        system = sparse.diags(weight + pull) + reach**2 * self._stiffness
        return splu(system.tocsc()).solve((means - middle) * weight[:, None]) + middle

    @cached_property
    def _areas(self) -> np.ndarray:
        """Surface in mm^2 that belongs to each vertex, [V]."""
        return np.bincount(self.mesh.faces.ravel(), np.repeat(self._doubled_areas / 6, 3), len(self.mesh.vertices))

    @cached_property
    def _doubled_areas(self) -> np.ndarray:
        """Twice the area of each triangle in mm^2, [F]."""
        corners = self.mesh.vertices[self.mesh.faces]
        return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)

    @cached_property
    def _stiffness(self) -> sparse.csr_matrix:
        """Cotangent Laplacian [V, V] (Pinkall and Polthier 1993), positive semi-definite, without obtuse corners."""
        corners, count = self.mesh.vertices[self.mesh.faces], len(self.mesh.vertices)
        rows, columns, weights = [], [], []
        for i in range(3):
            a, b = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
            cotangent = (a * b).sum(1) / np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-9)
            rows.append(self.mesh.faces[:, (i + 1) % 3])
            columns.append(self.mesh.faces[:, (i + 2) % 3])
            weights.append(np.clip(cotangent, 1e-3, 20) / 2)
        weights, rows, columns = (np.concatenate(each) for each in (weights, rows, columns))
        half = sparse.coo_matrix((weights, (rows, columns)), (count, count)).tocsr()
        both = half + half.T
        return sparse.diags(np.asarray(both.sum(1)).ravel()) - both


def lay_out(head: Mesh, size: int, check: Callable[[], None] = lambda: None) -> HeadSurface:
    """Return the surface of a head in metres, with UVs, under maps of that size. `check` may raise to cancel."""
    sewn, _ = surfaces.welded(head.moved(head.vertices * 1000))
    strips = []
    for row in range(0, size, STRIP_ROWS):
        check()
        strips.append(raster.rasterize_uv(sewn, size, (row, min(row + STRIP_ROWS, size))))
    return HeadSurface(sewn, size, *(np.concatenate(parts) for parts in zip(*strips, strict=True)))
