# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake maps of one surface into the UVs of another that lies on it.

Each texel of the target reads at its partner on the source. Maps are processed in strips of rows, one after the other,
so that memory stays at a few maps of the target's size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ..imaging import images
from . import atlas, raster, surfaces
from .meshes import Mesh, vertex_normals

STRIP_ROWS = 128
"""Rows processed at once: limits memory and the time until a cancel."""
BLEED_PX = 16
"""Margin in a map of 4096; proportionally less in smaller ones, but at least two."""


@dataclass(frozen=True)
class TexelPartners:
    """Partners of the texels [S, S] of a tile in the source's maps.

    uv float32 [S, S, 2] (nan: no partner); turn float32 [S, S]: angle in radians from the source's tangent directions
    to the target's; mirrored bool [S, S]: one of the two is a mirror image; covered bool [S, S]: inside a triangle.
    """

    uv: np.ndarray
    turn: np.ndarray
    mirrored: np.ndarray
    covered: np.ndarray

    @property
    def known(self) -> np.ndarray:
        return np.isfinite(self.uv[..., 0])


class Source:
    """A surface whose maps are read, indexed for search."""

    def __init__(self, mesh: Mesh):
        self.mesh = surfaces.welded(mesh)[0]
        self.surface = surfaces.Surface(self.mesh)
        self.tangent, self.hand = surfaces.tangents(self.mesh)


def places(
    target: Mesh,
    tile,
    source: Source,
    size: int,
    farthest: float,
    tick: Callable[[float], None],
    painted: np.ndarray | None = None,
) -> TexelPartners:
    """Find the partners of the texels of a tile (u, v) of the target's UVs, at most `farthest` metres away.

    `tick` is called with the share done, per strip; `painted` bool [F]: the triangles that count (default: all).
    """
    whole = surfaces.welded(target)[0]
    where = (atlas.tiles(whole) == np.asarray(tile)).all(1) & (True if painted is None else painted)
    tangent, hand = surfaces.tangents(whole)
    tangent, hand, normals = tangent[where], hand[where], vertex_normals(whole)
    patch = atlas.in_tile(whole, tile, where)
    low, high = _rows(patch, size)
    uv = np.full((size, size, 2), np.nan, np.float32)
    turn = np.zeros((size, size), np.float32)
    mirrored, covered = np.zeros((size, size), bool), np.zeros((size, size), bool)
    for row in range(0, size, STRIP_ROWS):
        tick(row / size)
        end = min(row + STRIP_ROWS, size)
        crossing = (high >= row) & (low <= end)
        if not crossing.any():
            continue
        strip = atlas.in_tile(patch, (0, 0), crossing)
        face, bary = raster.rasterize_uv(strip, size, (row, end))
        inside = face >= 0
        covered[row:end] = inside
        face, bary = np.flatnonzero(crossing)[face[inside]], bary[inside].astype(np.float64)
        points = raster.interpolate(patch.vertices, patch.faces, face, bary)
        t, b, n = surfaces.frames(normals, patch.faces, tangent, hand, face, bary)
        partner, partner_bary = source.surface.find_partners(points, n, farthest)
        matched = partner >= 0
        partner, partner_bary = partner[matched], partner_bary[matched]
        source_uv = (source.mesh.uvs[source.mesh.face_uvs[partner]] * partner_bary[:, :, None]).sum(1)
        angle = _turn(source, partner, partner_bary, t[matched], b[matched], n[matched])
        mirror = source.hand[partner] != hand[face[matched]]
        for array, samples in ((uv, source_uv), (turn, angle), (mirrored, mirror)):
            view = array[row:end]
            flat = view[inside]
            flat[matched] = samples
            view[inside] = flat
    return TexelPartners(uv, turn, mirrored, covered)


def bake(image: np.ndarray, at: TexelPartners) -> np.ndarray:
    """Read a source map [H, W(, C)] at the partners, bicubic: [S, S(, C)] float32, gaps filled and bled."""
    image = _matched(np.asarray(image, np.float32), at)
    height, width = image.shape[:2]
    out = np.empty((*at.covered.shape, *image.shape[2:]), np.float32)
    low, high = image.min(), image.max()
    for row in range(0, len(out), STRIP_ROWS):
        uv = np.nan_to_num(at.uv[row : row + STRIP_ROWS])
        x, y = uv[..., 0] * width - 0.5, (1 - uv[..., 1]) * height - 0.5
        # cubic overshoots at edges
        out[row : row + STRIP_ROWS] = np.clip(
            cv2.remap(image, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE), low, high
        )
    return bled(out, at)


def bake_normals(packed: np.ndarray, at: TexelPartners) -> np.ndarray:
    """Bake a tangent space normal map [H, W, 3] in [0, 1] (OpenGL, Y up), rotated into the target's tangent frames.

    The deviation from the source's smooth surface is kept; the target brings a smooth surface of its own.
    """
    out = bake(packed, at)
    for row in range(0, len(out), STRIP_ROWS):
        rows = np.s_[row : row + STRIP_ROWS]
        vectors = out[rows] * 2 - 1
        turn, known = at.turn[rows], at.known[rows]
        x, y = vectors[..., 0].copy(), vectors[..., 1] * np.where(at.mirrored[rows], -1, 1)
        c, s = np.cos(turn), np.sin(turn)
        vectors[..., 0], vectors[..., 1] = c * x - s * y, s * x + c * y
        vectors = np.where(known[..., None], vectors, [0, 0, 1])
        out[rows] = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-6) * 0.5 + 0.5
    return bled(out, at)


def bled(image: np.ndarray, at: TexelPartners) -> np.ndarray:
    """Fill a map: nearest texels in a margin around the known ones, a smooth continuation beyond."""
    known = at.known
    if known.all() or not known.any():
        return image
    margin = max(2, round(BLEED_PX * len(image) / 4096))
    near = cv2.distanceTransform((~known).astype(np.uint8), cv2.DIST_L2, 5) <= margin + 1
    small = min(512, len(image))
    weight = images.resize(known.astype(np.float32), small, small)
    mean = images.resize(
        np.where(known[..., None], image.reshape(*known.shape, -1), 0).astype(np.float32), small, small
    ).reshape(small, small, -1)
    smooth = cv2.resize(_continued(mean, weight), known.shape[::-1], interpolation=cv2.INTER_LINEAR)
    smooth = smooth.reshape(image.shape)
    nearest = raster.bleed(image, known)
    return np.where(near.reshape(near.shape + (1,) * (image.ndim - 2)), nearest, smooth)


def _continued(weighted: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Fill values times weights [h, w, C] with weights [h, w] in [0, 1] by pull-push (Gortler et al. 1996)."""
    if min(weight.shape) <= 2:
        return np.broadcast_to(weighted.sum((0, 1)) / max(weight.sum(), 1e-6), weighted.shape).astype(np.float32)
    half = (weight.shape[1] + 1) // 2, (weight.shape[0] + 1) // 2
    smaller = cv2.resize(weighted, half, interpolation=cv2.INTER_AREA)
    down = smaller.reshape(*half[::-1], -1), cv2.resize(weight, half, interpolation=cv2.INTER_AREA)
    gain = np.minimum(4 * down[1], 1) / np.maximum(down[1], 1e-6)  # one known texel of four is enough
    coarse = cv2.resize(
        _continued(down[0] * gain[..., None], down[1] * gain), weight.shape[::-1], interpolation=cv2.INTER_LINEAR
    )
    return (weighted + coarse.reshape(weighted.shape) * (1 - weight[..., None])).astype(np.float32)


def _matched(image: np.ndarray, at: TexelPartners) -> np.ndarray:
    """Shrink a source map that is finer than the target's texels, so that no detail is skipped."""
    step = np.linalg.norm(np.diff(at.uv[::2], axis=1) * [image.shape[1], image.shape[0]], axis=-1)
    step = float(np.nanmedian(step)) if np.isfinite(step).any() else 1.0
    return images.resize(image, round(image.shape[1] / step), round(image.shape[0] / step)) if step > 1.3 else image


def _rows(mesh: Mesh, size: int) -> tuple[np.ndarray, np.ndarray]:
    """First and last row [F] that each triangle can touch."""
    v = (1 - mesh.uvs[mesh.face_uvs][..., 1]) * size
    return np.floor(v.min(1)) - 1, np.ceil(v.max(1)) + 1


def _turn(
    source: Source, face: np.ndarray, bary: np.ndarray, t: np.ndarray, b: np.ndarray, n: np.ndarray
) -> np.ndarray:
    """Angles [N] from the target's tangent t to the source's at face, bary, towards b.

    The source's normal is first rotated to the target's n [N, 3] by the smallest rotation.
    """
    tangent, _, normal = surfaces.frames(
        source.surface.normals, source.mesh.faces, source.tangent, source.hand, face, bary
    )
    lean = (tangent * n).sum(1, keepdims=True) / np.maximum(1 + (normal * n).sum(1, keepdims=True), 1e-6)
    tangent = tangent - lean * (normal + n)
    return np.arctan2((tangent * b).sum(1), (tangent * t).sum(1))
