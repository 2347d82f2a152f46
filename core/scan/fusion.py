# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth maps to one surface: a truncated signed distance field in blocks around what was seen, and its zero by marching cubes.

Curless and Levoy, A Volumetric Method for Building Complex Models from Range Images (1996).
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import trimesh
from scipy.ndimage import binary_dilation
from skimage.measure import marching_cubes

from ..meshes import Mesh
from .stereo import DepthMap

SIDE = 8
"""Voxels along a block's edge."""
TRUNCATION = 5
"""Reach of the distance field on either side of the surface, in voxels."""
LEAST_WEIGHT, LEAST_SHARE = 2.0, 0.15
"""Maps that must agree for a voxel to count (a head-on view weighs 1), fewer where a handful of photographs makes few maps."""


def fuse(maps: list[DepthMap], box: np.ndarray, voxel: float, tick: Callable[[int], None] = lambda done: None) -> Mesh | None:
    """The surface of depth maps within the box [2, 3], with voxels of `voxel` metres; its largest piece, or None where there is none."""
    low = box[0]
    shape = np.ceil((box[1] - low) / (voxel * SIDE)).astype(int)
    blocks = _blocks_seen(maps, low, shape, voxel)
    if not len(blocks):
        return None
    base = np.stack(np.unravel_index(blocks, shape), -1) * SIDE
    corner = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), -1).reshape(-1, 3)
    voxels = (base[:, None] + corner[None]).reshape(-1, 3)
    distance, weight = np.zeros(len(voxels), np.float32), np.zeros(len(voxels), np.float32)
    points = (low + voxels * voxel).astype(np.float32)
    for done, seen in enumerate(maps):
        _integrate(seen, points, voxel, distance, weight)
        tick(done + 1)
    field = np.ones(shape * SIDE, np.float32)
    known = np.zeros(shape * SIDE, bool)
    index = tuple(voxels.T)
    field[index] = distance / np.maximum(weight, 1e-6)
    known[index] = weight >= min(LEAST_WEIGHT, LEAST_SHARE * len(maps))
    return _surface(field, known, low, voxel)


def _blocks_seen(maps: list[DepthMap], low: np.ndarray, shape: np.ndarray, voxel: float) -> np.ndarray:
    """Flat indices of the blocks that any map's surface comes within the truncation of."""
    found = np.zeros(shape, bool)
    for seen in maps:
        y, x = np.nonzero(np.isfinite(seen.depth[::2, ::2]))
        z = seen.depth[::2, ::2][y, x]
        local = np.stack([(2 * x + 0.5 + seen.origin[0]) * z / seen.focal, (2 * y + 0.5 + seen.origin[1]) * z / seen.focal, z], -1)
        cell = np.floor((local @ seen.rotation + seen.centre - low) / (voxel * SIDE)).astype(int)
        cell = cell[((cell >= 0) & (cell < shape)).all(1)]
        found[tuple(cell.T)] = True
    return np.flatnonzero(binary_dilation(found, np.ones((3, 3, 3), bool)))


def _integrate(seen: DepthMap, points: np.ndarray, voxel: float, distance: np.ndarray, weight: np.ndarray) -> None:
    """Adds one map's signed distances (in truncations, positive in front of the surface) where it sees the voxels or just behind."""
    local = (points - seen.centre.astype(np.float32)) @ seen.rotation.T.astype(np.float32)
    u = np.floor(seen.focal * local[:, 0] / local[:, 2] - seen.origin[0]).astype(np.int32)
    v = np.floor(seen.focal * local[:, 1] / local[:, 2] - seen.origin[1]).astype(np.int32)
    height, width = seen.depth.shape
    inside = np.flatnonzero((u >= 0) & (u < width) & (v >= 0) & (v < height))
    cosine = _cosine(seen)
    depth, facing = seen.depth[v[inside], u[inside]], cosine[v[inside], u[inside]]
    reach = TRUNCATION * voxel
    gap = (depth - local[inside, 2]) * facing  # along the surface's normal
    near = np.isfinite(gap) & (gap > -reach) & (facing > 0.2)
    index, value = inside[near], np.minimum(gap[near] / reach, 1)
    share = facing[near] ** 2
    total = weight[index] + share
    distance[index] += value * share
    weight[index] = total


def _cosine(seen: DepthMap) -> np.ndarray:
    """How squarely the map's surface faces its rays, [H, W] in [0, 1]; 0 at steps and where unknown."""
    height, width = seen.depth.shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    rays = np.stack([(x + 0.5 + seen.origin[0]) / seen.focal, (y + 0.5 + seen.origin[1]) / seen.focal, np.ones_like(x)], -1)
    known = np.isfinite(seen.depth)
    filled = np.where(known, seen.depth, 0).astype(np.float32)
    share = cv2.blur(known.astype(np.float32), (5, 5))
    smooth = np.where(known, cv2.blur(filled, (5, 5)) / np.maximum(share, 1e-6), np.nan)
    points = rays * smooth[..., None]
    across = np.full((height, width, 3), np.nan, np.float32)
    down = across.copy()
    across[:, 1:-1], down[1:-1] = points[:, 2:] - points[:, :-2], points[2:] - points[:-2]
    normal = np.cross(across, down)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs((normal * rays).sum(-1)) / (np.linalg.norm(normal, axis=-1) * np.linalg.norm(rays, axis=-1))
    return np.nan_to_num(cosine, nan=0.0)


def _surface(field: np.ndarray, known: np.ndarray, low: np.ndarray, voxel: float) -> Mesh | None:
    if not known.any():
        return None
    try:
        vertices, faces, _, _ = marching_cubes(field, 0.0, mask=known, gradient_direction="descent")
    except (ValueError, RuntimeError):  # no zero crossing
        return None
    solid = trimesh.Trimesh(vertices * voxel + low, faces, process=False)
    pieces = trimesh.graph.connected_component_labels(solid.face_adjacency, node_count=len(solid.faces))
    if not len(pieces):
        return None
    solid.update_faces(pieces == np.bincount(pieces).argmax())
    solid.remove_unreferenced_vertices()
    trimesh.smoothing.filter_taubin(solid, iterations=4)
    return Mesh(np.asarray(solid.vertices, np.float64), np.asarray(solid.faces, np.int64))
