# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""New UVs for a mesh by xatlas (MIT), and the faults of a mesh's own UVs.

A UV tile is the unit square at whole (u, v); tile (0, 0) is UDIM 1001, (1, 0) is 1002, (0, 1) is 1011.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import raster
from .meshes import Mesh

CHECK_SIDE_TEXELS = 512
"""Side of the map in which overlaps and packing are counted."""
FILLED_SHARE = 0.6
"""Share of the square that a face's charts are expected to fill; decides the scale at which they are packed."""
MOST_OVERLAP_SHARE = 0.01
"""Tolerated share of texels under two triangles: charts touch, and fans of tiny triangles fold."""


def unwrap(mesh: Mesh, size: int, gap_px: int = 2) -> Mesh:
    """Return the mesh with new UVs in one square, charts about 2 `gap_px` texels apart in a map of `size`.

    Deterministic. Triangles without area end up in a corner.
    """
    import xatlas  # here, because only jobs that unwrap need it

    atlas, charts, packing = xatlas.Atlas(), xatlas.ChartOptions(), xatlas.PackOptions()
    # xatlas rotates a chart by swapping u and v, which mirrors it
    charts.fix_winding, packing.rotate_charts = True, False
    packing.padding, packing.bilinear = gap_px, True
    # a fixed resolution would leave room for a third of the texels
    packing.texels_per_unit = size * np.sqrt(FILLED_SHARE / _areas(mesh).sum())
    atlas.add_mesh(
        np.ascontiguousarray(mesh.vertices - mesh.vertices.mean(0), np.float32),
        np.ascontiguousarray(mesh.faces, np.uint32),
    )
    atlas.generate(charts, packing)
    _, faces, uvs = atlas[0]
    side = max(atlas.width, atlas.height)  # the packed area is not square, texels are
    mapped = replace(
        mesh,
        uvs=np.asarray(uvs, np.float64) * [atlas.width / side, atlas.height / side],
        face_uvs=np.asarray(faces, np.int64),
    )
    mirrored = _double_areas(mapped.uvs[mapped.face_uvs]).sum() < 0
    return replace(mapped, uvs=np.abs([0, float(mirrored)] - mapped.uvs))


def tiles(mesh: Mesh) -> np.ndarray:
    """Return the tile of each triangle, int [F, 2]: that of its centroid, as a chart may end on a tile's edge."""
    return np.floor(mesh.uvs[mesh.face_uvs].mean(1)).astype(np.int64)


def udim(tile) -> int:
    """Return the UDIM number of a tile (u, v). Raises ValueError for tiles left of, below or beyond the ten columns."""
    u, v = (int(x) for x in tile)
    if not (0 <= u < 10 and v >= 0):
        raise ValueError(f"tile {u}, {v} has no UDIM number")
    return 1001 + u + 10 * v


def in_tile(mesh: Mesh, tile, chosen: np.ndarray) -> Mesh:
    """Return the triangles `chosen` bool [F] with their UVs moved from `tile` to the unit square."""
    return replace(mesh, faces=mesh.faces[chosen], uvs=mesh.uvs - np.asarray(tile), face_uvs=mesh.face_uvs[chosen])


def faults(mesh: Mesh) -> list[str]:
    """Return what prevents painting a map in a mesh's UVs, one sentence each."""
    if mesh.uvs is None:
        return ["It has no UVs, or some of its polygons have none."]
    tile = tiles(mesh)
    defects = []
    if tile.min() < 0 or tile[:, 0].max() > 9:
        defects.append("Some UVs lie left of the first tile, below it or more than ten tiles to its right.")
    collapsed = (np.abs(_double_areas(mesh.uvs[mesh.face_uvs])) < 1e-12).mean()
    if collapsed > 0.05:
        defects.append(f"{100 * collapsed:.0f} percent of the triangles have no area in the UVs.")
    overlap = overlap_share(mesh)
    if overlap > MOST_OVERLAP_SHARE:
        defects.append(f"{100 * overlap:.0f} percent of the UVs overlap.")
    return defects


def overlap_share(mesh: Mesh) -> float:
    """Return the share of covered texels that lie in more than one triangle."""
    tile_of = tiles(mesh)
    covered = doubled = 0
    for tile in np.unique(tile_of, axis=0):
        patch = in_tile(mesh, tile, (tile_of == tile).all(1))
        backwards = replace(patch, faces=patch.faces[::-1], face_uvs=patch.face_uvs[::-1])
        first, last = (raster.rasterize_uv(each, CHECK_SIDE_TEXELS)[0] for each in (patch, backwards))
        last = np.where(last >= 0, len(patch.faces) - 1 - last, -1)
        covered += (first >= 0).sum()
        doubled += (first != last).sum()
    return float(doubled / max(covered, 1))


def packing(mesh: Mesh) -> float:
    """Return the share of the first tile that charts cover."""
    return float((raster.rasterize_uv(mesh, CHECK_SIDE_TEXELS)[0] >= 0).mean())


def stretch(mesh: Mesh) -> np.ndarray:
    """Return the larger stretch of each triangle [F], relative to the map's mean scale.

    1 keeps its shape and scale, 2 is doubled or halved in some direction (singular values of Sander et al. 2001).
    """
    corners, uvs = mesh.vertices[mesh.faces], mesh.uvs[mesh.face_uvs]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.maximum(np.linalg.norm(e1, axis=1), 1e-12)
    x, y = (e2 * e1).sum(1) / length, np.linalg.norm(np.cross(e1, e2), axis=1) / length
    area = length * y / 2
    # rows: edges in the plane
    flat = np.stack([np.stack([length, np.zeros_like(length)], -1), np.stack([x, np.maximum(y, 1e-12)], -1)], 1)
    mapped = np.linalg.solve(flat, np.stack([uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]], 1))
    singular = np.linalg.svd(mapped, compute_uv=False)
    scale = np.sqrt((np.abs(_double_areas(uvs)) / 2).sum() / area.sum())
    return np.maximum(singular[:, 0] / scale, scale / np.maximum(singular[:, 1], 1e-12))


def _areas(mesh: Mesh) -> np.ndarray:
    """Areas [F] of the triangles."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _double_areas(uvs: np.ndarray) -> np.ndarray:
    """Twice the signed areas [F] of UV triangles [F, 3, 2]."""
    a, b = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
