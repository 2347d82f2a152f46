# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fusion of depth maps: a truncated signed distance field in blocks around them, and its zero by marching cubes.

Curless and Levoy, A Volumetric Method for Building Complex Models from Range Images (1996).
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from scipy.ndimage import binary_dilation
from skimage.measure import marching_cubes

from ...geometry.meshes import Mesh
from ...geometry.views import lengths
from .stereo import DepthMap

BLOCK_VOXELS = 8
TRUNCATION_VOXELS = 5  # reach of the distance field on either side of the surface
LEAST_WEIGHT, LEAST_SHARE = 2.0, 0.15
"""Minimum number of maps that agree on a voxel (a head-on view weighs 1), and minimum share where there are few
maps."""
MOST_SPREAD_TRUNCATIONS = 0.6
"""Deviation of the maps' distances, in truncations, beyond which they do not show one surface: hair, a hand that moved,
a highlight that wandered."""

VOXELS_AT_ONCE = 1 << 18  # voxels to which a map is added at once: intermediate results stay in the processor's caches
LEAST_PIECE_SHARE = 0.05
"""Minimum triangles of a piece, as a share of the largest: smaller ones are background seen through hair, or a flap of
a collar."""


@dataclass(frozen=True)
class Fused:
    """Fused surface.

    disagreeing: share of the voxels at it that the maps disagree about and that were left out; floating: share of the
    triangles that hung loose and were left out.
    """

    mesh: Mesh
    disagreeing: float
    floating: float


def fuse(
    maps: list[DepthMap], box: np.ndarray, voxel: float, tick: Callable[[int], None] = lambda done: None
) -> Fused | None:
    """Fuse depth maps in a box [2, 3], in voxels of that side, metres; None without a surface.

    A map counts with the square of its baseline over its distance: heads are matched at one size, so that from twice as
    far the same angle measures depth as finely.
    """
    low = box[0]
    shape = np.ceil((box[1] - low) / (voxel * BLOCK_VOXELS)).astype(int)
    blocks = _blocks_seen(maps, low, shape, voxel)
    if not len(blocks):
        return None
    base = np.stack(np.unravel_index(blocks, shape), -1) * BLOCK_VOXELS
    corner = np.stack(np.meshgrid(*[np.arange(BLOCK_VOXELS)] * 3, indexing="ij"), -1).reshape(-1, 3)
    voxels = (base[:, None] + corner[None]).reshape(-1, 3)
    sums = np.zeros((4, len(voxels)), np.float32)  # facing, weight, weight x distance, weight x distance squared
    points = np.ascontiguousarray((low + voxels * voxel).astype(np.float32).T)
    angles = np.array([depth_map.baseline / np.nanmedian(depth_map.depth) for depth_map in maps])
    finer = np.clip(angles / np.median(angles), 0.25, 2)
    for done, depth_map in enumerate(maps):
        _integrate(depth_map, points, voxel, float(finer[done] ** 2), sums)
        tick(done + 1)
    facing, weight = sums[0], np.maximum(sums[1], 1e-6)
    mean = sums[2] / weight
    agreeing = np.sqrt(np.maximum(sums[3] / weight - mean**2, 0)) < MOST_SPREAD_TRUNCATIONS
    enough = facing >= min(LEAST_WEIGHT, LEAST_SHARE * len(maps))
    at_surface = enough & (np.abs(mean) < 0.5)
    field = np.ones(shape * BLOCK_VOXELS, np.float32)
    certain = np.zeros(shape * BLOCK_VOXELS, bool)
    index = tuple(voxels.T)
    field[index], certain[index] = np.where(enough & agreeing, mean, 1), enough & agreeing
    # a cube counts only with all its corners known: an unknown one would add a false wall
    for axis in range(3):
        certain &= np.roll(certain, -1, axis)
    surface = _surface(field, certain, low, voxel)
    if surface is None:
        return None
    disagreeing = float((at_surface & ~agreeing).sum() / max(at_surface.sum(), 1))
    return Fused(surface[0], disagreeing, surface[1])


def _blocks_seen(maps: list[DepthMap], low: np.ndarray, shape: np.ndarray, voxel: float) -> np.ndarray:
    """Return flat indices of the blocks within the truncation of any map's surface."""
    occupied = np.zeros(shape, bool)
    for m in maps:
        y, x = np.nonzero(np.isfinite(m.depth[::2, ::2]))
        z = m.depth[::2, ::2][y, x]
        local = np.stack([(2 * x + 0.5 + m.origin[0]) * z / m.focal, (2 * y + 0.5 + m.origin[1]) * z / m.focal, z], -1)
        cell = np.floor((local @ m.rotation + m.centre - low) / (voxel * BLOCK_VOXELS)).astype(int)
        cell = cell[((cell >= 0) & (cell < shape)).all(1)]
        occupied[tuple(cell.T)] = True
    return np.flatnonzero(binary_dilation(occupied, np.ones((3, 3, 3), bool)))


def _integrate(depth_map: DepthMap, points: np.ndarray, voxel: float, precision: float, sums: np.ndarray) -> None:
    """Add a map's signed distances to sums [4, N] where it sees the voxels [3, N] or just behind.

    Distances are in truncations, positive in front of the surface.
    """
    cosine = _cosine(depth_map)
    for first in range(0, points.shape[1], VOXELS_AT_ONCE):
        chunk = np.s_[:, first : first + VOXELS_AT_ONCE]
        _integrate_part(depth_map, cosine, points[chunk], voxel, precision, sums[chunk])


def _integrate_part(
    depth_map: DepthMap, cosine: np.ndarray, points: np.ndarray, voxel: float, precision: float, sums: np.ndarray
) -> None:
    local = depth_map.rotation.astype(np.float32) @ (points - depth_map.centre.astype(np.float32)[:, None])
    u = np.floor(depth_map.focal * local[0] / local[2] - depth_map.origin[0]).astype(np.int32)
    v = np.floor(depth_map.focal * local[1] / local[2] - depth_map.origin[1]).astype(np.int32)
    height, width = depth_map.depth.shape
    inside = np.flatnonzero((u >= 0) & (u < width) & (v >= 0) & (v < height))
    depth, facing = depth_map.depth[v[inside], u[inside]], cosine[v[inside], u[inside]]
    reach = TRUNCATION_VOXELS * voxel
    gap = (depth - local[2, inside]) * facing  # along the surface's normal
    near = np.isfinite(gap) & (gap > -reach) & (facing > 0.2)
    index, value = inside[near], np.minimum(gap[near] / reach, 1)
    share = facing[near] ** 2
    terms = (share, precision * share, precision * share * value, precision * share * value**2)
    for row, term in zip(sums, terms, strict=True):
        row[index] += term


def _cosine(depth_map: DepthMap) -> np.ndarray:
    """Return how squarely the map's surface faces its rays, [H, W] in [0, 1]; 0 at steps and where unknown."""
    height, width = depth_map.depth.shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    rays = depth_map.rays(x, y)
    valid = np.isfinite(depth_map.depth)
    filled = np.where(valid, depth_map.depth, 0).astype(np.float32)
    share = cv2.blur(valid.astype(np.float32), (5, 5))
    smooth = np.where(valid, cv2.blur(filled, (5, 5)) / np.maximum(share, 1e-6), np.nan)
    points = rays * smooth[..., None]
    across = np.full((height, width, 3), np.nan, np.float32)
    down = across.copy()
    across[:, 1:-1], down[1:-1] = points[:, 2:] - points[:, :-2], points[2:] - points[:-2]
    normal = np.cross(across, down)
    along = normal[..., 0] * rays[..., 0] + normal[..., 1] * rays[..., 1] + normal[..., 2] * rays[..., 2]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.nan_to_num(np.abs(along) / (lengths(normal) * lengths(rays)), nan=0.0)


def _surface(field: np.ndarray, observed: np.ndarray, low: np.ndarray, voxel: float) -> tuple[Mesh, float] | None:
    """Return the zero of the field: its large pieces, and the share of the triangles in small ones."""
    if not observed.any():
        return None
    try:
        vertices, faces, _, _ = marching_cubes(field, 0.0, mask=observed, gradient_direction="descent")
    except (ValueError, RuntimeError):  # no zero crossing
        return None
    solid = trimesh.Trimesh(vertices * voxel + low, faces, process=False)
    pieces = trimesh.graph.connected_component_labels(solid.face_adjacency, node_count=len(solid.faces))
    if not len(pieces):
        return None
    large = np.isin(pieces, np.flatnonzero(np.bincount(pieces) >= LEAST_PIECE_SHARE * np.bincount(pieces).max()))
    solid.update_faces(large)
    solid.remove_unreferenced_vertices()
    trimesh.smoothing.filter_taubin(solid, iterations=4)
    return Mesh(np.asarray(solid.vertices, np.float64), np.asarray(solid.faces, np.int64)), 1 - float(large.mean())
