# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to pixels: in UV space by rasterising, in a camera by ray casting; and visibility.

Row 0 of a UV map is its top: texel (row, column) of an S x S map has its centre at u = (column + 0.5) / S, v = 1 - (row
+ 0.5) / S.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from .meshes import Mesh
from .views import View

BENT_SIDE_SHARE = 0.01
"""Margin for lenses that bend a mesh's edge out of the box of its vertices, as a share of the picture's sides."""
TEXELS_AT_ONCE = 60_000
"""Texels of many triangles are rasterised together, up to a hundred times faster than one by one; more than fits the
processor's cache gains nothing."""


def rasterize_uv(mesh: Mesh, size: int, rows: tuple[int, int] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangle at each texel's centre, int32 [S, S] (-1: none), and barycentric float32 [S, S, 3].

    `rows` (first, end): only that strip of the map, [end - first, S].
    """
    first, end = rows or (0, size)
    # [F, 3, 2] in texels: x = column, y = row
    corners = mesh.uvs[mesh.face_uvs] * [size, -size] + [-0.5, size - 0.5 - first]
    face = np.full((end - first, size), -1, np.int32)
    bary = np.zeros((end - first, size, 3), np.float32)
    low = np.maximum(np.ceil(corners.min(1)), 0).astype(int)
    high = np.minimum(np.floor(corners.max(1)), [size - 1, end - first - 1]).astype(int)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    used = np.flatnonzero((np.abs(area) > 1e-12) & (high >= low).all(1))
    for f, x, y in _texels(used, low[used], high[used]):
        (ax, ay), (bx, by), (cx, cy), twice = a[f].T, b[f].T, c[f].T, area[f]
        wa = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / twice
        wb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / twice
        wc = 1 - wa - wb
        inside = (wa >= -1e-9) & (wb >= -1e-9) & (wc >= -1e-9)
        # of overlapping triangles the last one wins, as in NumPy's assignment
        face[y[inside], x[inside]] = f[inside]
        bary[y[inside], x[inside]] = np.stack([wa, wb, wc], -1)[inside]
    return face, bary


def _texels(
    triangles: np.ndarray, low: np.ndarray, high: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield triangle, column and row of all texels in the boxes low, high [N, 2] of triangles [N], in chunks."""
    sides = high - low + 1
    ends = np.cumsum(sides.prod(1))
    first, before = 0, 0
    while first < len(triangles):
        end = max(first + 1, int(np.searchsorted(ends, before + TEXELS_AT_ONCE, "right")))
        count = np.diff(ends[first:end], prepend=before)
        box = np.repeat(np.arange(first, end), count)
        within = np.arange(before, ends[end - 1]) - np.repeat(ends[first:end] - count, count)
        row, column = np.divmod(within, sides[box, 0])
        yield triangles[box], column + low[box, 0], row + low[box, 1]
        first, before = end, ends[end - 1]


def interpolate(vertex_values: np.ndarray, corners: np.ndarray, face: np.ndarray, bary: np.ndarray) -> np.ndarray:
    """Interpolate vertex values [V, C] at raster samples: [..., C], zero where face < 0.

    corners [F, 3] are the vertices of each triangle, face [...] and bary [..., 3] the samples.
    """
    vertices = corners[np.maximum(face, 0)]
    # several times faster than a sum over an axis of three
    first, second, third = (vertex_values[vertices[..., k]] * bary[..., k, None] for k in range(3))
    return (first + second + third) * (face >= 0)[..., None]


def bleed(image: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Give every texel of [H, W(, C)] that is not `valid` [H, W] the value of the nearest valid one.

    Filtering then meets no black seam.
    """
    if valid.all() or not valid.any():
        return image
    _, labels = cv2.distanceTransformWithLabels(
        (~valid).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = np.zeros(labels.max() + 1, np.int64)
    nearest[labels[valid]] = np.flatnonzero(valid)
    return image.reshape(-1, *image.shape[2:])[nearest[labels]]


class RayCaster:
    """First hits of rays with a mesh (Embree)."""

    def __init__(self, mesh: Mesh):
        self.mesh = mesh
        self._intersector = RayMeshIntersector(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False))

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cast rays from origins along unit directions [N, 3].

        Returns face int64 [N] (-1: miss), barycentric [N, 3] and distance [N] in metres (inf: miss).
        """
        count = len(directions)
        face, bary, distance = np.full(count, -1), np.zeros((count, 3)), np.full(count, np.inf)
        if count:
            triangle, ray, location = self._intersector.intersects_id(
                origins, directions, multiple_hits=False, return_locations=True
            )
            face[ray] = triangle
            bary[ray] = trimesh.triangles.points_to_barycentric(self.mesh.vertices[self.mesh.faces[triangle]], location)
            distance[ray] = np.linalg.norm(location - origins[ray], axis=1)
        return face, bary, distance

    def blocked(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return whether each ray hits anything, bool [N]."""
        return self._intersector.intersects_any(origins, directions) if len(directions) else np.zeros(0, bool)


def visible_from(
    caster: RayCaster, points: np.ndarray, normals: np.ndarray, centre: np.ndarray, offset: float = 5e-4
) -> np.ndarray:
    """Return whether points [N, 3] with unit normals face a `centre` [3] and nothing of `caster` lies between.

    Rays start `offset` metres off the surface.
    """
    towards = centre - points
    directions = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    facing = (directions * normals).sum(1) > 0
    visible = np.zeros(len(points), bool)
    visible[facing] = ~caster.blocked(points[facing] + offset * normals[facing], directions[facing])
    return visible


def render_view(caster: RayCaster, view: View, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Render the mesh through a view's camera at `scale` times its size.

    Returns face int64 [h, w] (-1: background), barycentric [h, w, 3] and distance [h, w] in metres.
    """
    width, height = round(view.width * scale), round(view.height * scale)
    face, bary, distance = np.full((height, width), -1), np.zeros((height, width, 3)), np.full((height, width), np.inf)
    box = _box(caster.mesh, view, width, height)
    y, x = np.mgrid[box]
    pixels = (np.stack([x.ravel(), y.ravel()], -1) + 0.5) * [view.width / width, view.height / height]
    directions = view.rays(pixels)
    hits = caster.first_hits(np.repeat(view.centre[None], len(directions), 0), directions)
    for whole, patch in zip((face, bary, distance), hits, strict=True):
        whole[box] = patch.reshape(*x.shape, *patch.shape[1:])
    return face, bary, distance


def _box(mesh: Mesh, view: View, width: int, height: int) -> tuple[slice, slice]:
    """Rows and columns of a picture within which a view shows the mesh; all if part of it is behind the camera."""
    pixels, _ = view.project(mesh.vertices)
    if not np.isfinite(pixels).all():
        return slice(0, height), slice(0, width)
    low, high = (edge * [width / view.width, height / view.height] for edge in (pixels.min(0), pixels.max(0)))
    margin = BENT_SIDE_SHARE * (width + height)
    (left, top), (right, bottom) = np.floor(low - margin), np.ceil(high + margin)
    return tuple(
        slice(int(np.clip(first, 0, size)), int(np.clip(end, 0, size)))
        for first, end, size in ((top, bottom, height), (left, right, width))
    )


def sample(image: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Sample [H, W(, C)] bilinearly at pixels [N, 2] (pixel centres at +0.5; clamped at the border)."""
    xy = (np.asarray(pixels, np.float32) - 0.5).reshape(-1, 1, 2)
    image = np.ascontiguousarray(image, np.float32)
    chunks = [xy[i : i + 32000] for i in range(0, len(xy), 32000)]  # cv2.remap takes fewer than 32767 rows
    out = [
        cv2.remap(image, chunk[..., 0], chunk[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for chunk in chunks
    ]
    return np.concatenate(out)[:, 0] if out else np.zeros((0, *image.shape[2:]), np.float32)


def sample_uv(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Sample a square map [S, S, ...] bilinearly at UVs [N, 2]."""
    return sample(image, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * len(image))
