# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The template's skin as a canvas: the place of each texel on the head, in millimetres.

Everything is painted at points in space, never at UV coordinates, so the two sides of a UV seam get the same paint.
Values live in flat arrays over the N texels that the UV layout covers; `Canvas.spread` makes a picture of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import cv2
import numpy as np
from scipy.spatial import cKDTree

from core.face import template
from core.geometry import raster
from core.geometry.meshes import Mesh, unit, vertex_normals
from core.imaging import images

MASK_SIZE = 1024  # of the template's masks; they are soft, so a window takes its part of them enlarged


@dataclass(frozen=True)
class Canvas:
    """Texels of a head.

    size S; covered bool [S, S], N of them true; position float32 [N, 3] in mm; normal float32 [N, 3] unit; masks name
    -> float32 [N] in [0, 1]; landmarks float64 [468, 3] in mm; metric float32 [N, 3] in mm per texel: with T the unit
    tangent along +u and B the unit bitangent (orthogonal to T, towards +v) the surface's derivatives are dP/du = a T
    and dP/dv = b T + c B, stored as (a, b, c).
    """

    size: int
    covered: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    metric: np.ndarray
    masks: dict[str, np.ndarray]
    landmarks: np.ndarray
    cache: dict[str, np.ndarray] = field(default_factory=dict)  # for what depends on nothing but the canvas

    @cached_property
    def tree(self) -> cKDTree:
        return cKDTree(self.position, balanced_tree=False, compact_nodes=False)

    @cached_property
    def area(self) -> np.ndarray:
        """Surface per texel in mm^2, float32 [N]."""
        return np.abs(self.metric[:, 0] * self.metric[:, 2])

    @cached_property
    def texel_mm(self) -> float:
        """Width of the median texel in mm."""
        return float(np.sqrt(np.median(self.area)))

    @cached_property
    def bled_position(self) -> np.ndarray:
        """Positions float32 [S, S, 3]; beyond a chart's border those of the nearest texel."""
        return self.spread(self.position)

    @cached_property
    def _nearest(self) -> np.ndarray:
        index = np.zeros((self.size, self.size), np.int64)
        index[self.covered] = np.arange(len(self.position))
        return raster.bleed(index, self.covered)

    def spread(self, texel_values: np.ndarray) -> np.ndarray:
        """Return values [N(, C)] as a picture [S, S(, C)], bled beyond the charts."""
        return texel_values[self._nearest]

    def soft(self, values_of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Evaluate a function of points [M, 3] in mm, slow over 5 mm or more, at every fourth texel: [N]."""
        side = self.size // 4
        shrunk = cv2.resize(self.bled_position, (side, side), interpolation=cv2.INTER_AREA)
        small = np.asarray(values_of(shrunk.reshape(-1, 3)), np.float32).reshape(side, -1)
        return cv2.resize(small, (self.size,) * 2, interpolation=cv2.INTER_LINEAR)[self.covered]

    def near(self, points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return all pairs of points [M, 3] and texels within radius [M] mm.

        Texel [K], point [K] and distance [K] in mm.
        """
        if not len(points):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        neighbours = self.tree.query_ball_point(points, radius, return_sorted=False)
        counts = np.fromiter(map(len, neighbours), np.int64, len(neighbours))
        texel = np.concatenate([np.asarray(f, np.int64) for f in neighbours if f] or [np.zeros(0, np.int64)])
        point = np.repeat(np.arange(len(points)), counts)
        return texel, point, np.linalg.norm(self.position[texel] - points[point], axis=1)


@lru_cache(maxsize=4)
def canvas(size: int) -> Canvas:
    """Return the built-in template's canvas; made once per size and process."""
    mesh = template.load()
    return make_canvas(mesh, size, template.landmark_points(mesh), lambda name: template.mask(name, size))


def make_canvas(mesh: Mesh, size: int, landmarks: np.ndarray, mask: Callable[[str], np.ndarray]) -> Canvas:
    """Return the canvas of a head with UVs, in metres, whose face looks towards -Y.

    landmarks [468, 3] are MediaPipe's, in metres; mask(name) gives [size, size] in [0, 1].
    """
    return _canvas(mesh, size, *raster.rasterize_uv(mesh, size), landmarks, mask)


def make_window_canvas(size: int, row: int, column: int, side: int) -> Canvas:
    """Return a square window of the built-in template's canvas of `size` texels.

    It is painted as the whole would be there, but for hairs and scars that begin outside. row, column of its first
    texel, from the top left, and its side are multiples of size / MASK_SIZE, as size is of MASK_SIZE.
    """
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, size, (row, row + side))
    columns, factor = slice(column, column + side), size // MASK_SIZE

    def mask(name: str) -> np.ndarray:
        rows = slice(row // factor, -(-(row + side) // factor))
        columns = slice(column // factor, -(-(column + side) // factor))
        whole = template.mask(name, MASK_SIZE)[rows, columns]
        return images.resize(whole, side, side)

    return _canvas(mesh, size, face[:, columns], bary[:, columns], template.landmark_points(mesh), mask)


def relief_normals(height: np.ndarray, on: Canvas) -> np.ndarray:
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


def _canvas(
    mesh: Mesh, size: int, face: np.ndarray, bary: np.ndarray, landmarks: np.ndarray, mask: Callable[[str], np.ndarray]
) -> Canvas:
    """Return the canvas of rasterised texels [S, S] of a map of `size` texels."""
    covered = face >= 0
    position = raster.interpolate(mesh.vertices * 1000, mesh.faces, face[covered], bary[covered]).astype(np.float32)
    normal = unit(raster.interpolate(vertex_normals(mesh), mesh.faces, face[covered], bary[covered]).astype(np.float32))
    masks = {
        name: np.asarray(mask(name), np.float32)[covered]
        for name in ("skin", "lips", "brows", "eyes", "ears", "neck", "scalp", "nose")
    }
    return Canvas(len(face), covered, position, normal, _metric(mesh, size)[face[covered]], masks, landmarks * 1000)


def _metric(mesh: Mesh, size: int) -> np.ndarray:
    """Return (a, b, c) of Canvas.metric per face, float32 [F, 3]."""
    p, q = mesh.vertices[mesh.faces] * 1000, mesh.uvs[mesh.face_uvs] * size
    edges = np.stack([p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]], 1)  # [F, 2, 3] = uv_edges [F, 2, 2] @ derivative [F, 2, 3]
    uv_edges = np.stack([q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]], 1)
    sound = np.abs(np.linalg.det(uv_edges)) > 1e-9
    derivative = np.zeros((len(p), 2, 3))
    derivative[sound] = np.linalg.solve(uv_edges[sound], edges[sound])
    du, dv = derivative[:, 0], derivative[:, 1]
    a = np.maximum(np.linalg.norm(du, axis=1), 1e-9)
    b = (du * dv).sum(1) / a
    c = np.sqrt(np.maximum((dv * dv).sum(1) - b * b, 1e-12))
    return np.stack([a, b, c], 1).astype(np.float32)


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
