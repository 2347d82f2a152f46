# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Partners of points on another surface, and the tangent frames in which normal maps are written.

A partner is where the ray along a point's normal meets the other surface, or else its nearest point, and only where the
two surfaces face the same way: the inside of a lip is not a partner of the other lip.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
import trimesh
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .meshes import Mesh, unit, vertex_normals
from .raster import RayCaster, interpolate

SAME_WAY_COSINE = 0.3
"""Surfaces face the same way if the cosine between their normals is larger."""
CANDIDATE_COUNTS = (8, 64)
"""Samples near a point that are tried first, and if none of these fits."""
NEAR_SHARE = 0.25
"""Start of the first rays, as a share of `farthest`: most partners lie within, farther ones need a search."""
MOST_CUTS = 12
"""Halvings of edges: enough for a head of eight metres, not for one in millimetres."""


class Surface:
    """A mesh indexed for the search of partners; sampled every `spacing` metres for that of nearest points."""

    def __init__(self, mesh: Mesh, spacing: float = 0.002):
        self.mesh, self.normals = mesh, vertex_normals(mesh)
        corners, self._parent = _divided(mesh.vertices[mesh.faces], spacing)
        self._tree = cKDTree(corners.mean(1))
        self._caster = RayCaster(mesh)

    def find_partners(self, points: np.ndarray, normals: np.ndarray, farthest: float) -> tuple[np.ndarray, np.ndarray]:
        """Find the partners of points [N, 3] with unit normals on another surface, at most `farthest` metres away.

        Returns triangle int64 [N] (-1: none) and barycentric [N, 3].
        """
        lift = NEAR_SHARE * farthest
        face, bary, distance = self.cast_rays(points + lift * normals, -normals, normals)
        face = np.where(distance < 2 * lift, face, -1)
        missed = np.flatnonzero(face < 0)
        face[missed], bary[missed] = self.find_nearest(points[missed], normals[missed], farthest)
        return face, bary

    def cast_rays(
        self, origins: np.ndarray, directions: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return first hits of rays as RayCaster does, but face -1 where the surface does not face as `normals`."""
        face, bary, distance = self._caster.first_hits(origins, directions)
        return np.where(self._agree(face, bary, normals, SAME_WAY_COSINE), face, -1), bary, distance

    def find_nearest(
        self, points: np.ndarray, normals: np.ndarray, farthest: float, cosine: float = SAME_WAY_COSINE
    ) -> tuple[np.ndarray, np.ndarray]:
        """Find partners by distance alone; `cosine` between two normals from which they face the same way."""
        face, bary = self._nearest_of(CANDIDATE_COUNTS[0], points, normals, farthest, cosine)
        missed = np.flatnonzero(face < 0)  # another sheet may lie in front of the one that faces the same way
        more = self._nearest_of(CANDIDATE_COUNTS[1], points[missed], normals[missed], farthest, cosine)
        face[missed], bary[missed] = more
        return face, bary

    def _nearest_of(self, count: int, points, normals, farthest: float, cosine: float) -> tuple[np.ndarray, np.ndarray]:
        """Best of the `count` samples nearest to each point."""
        best_face, best_bary = np.full(len(points), -1), np.zeros((len(points), 3))
        _, index = self._tree.query(points, count, distance_upper_bound=farthest + 0.005)
        best = np.full(len(points), farthest)
        for column in index.T:
            there = np.flatnonzero(column < len(self._parent))
            face = self._parent[column[there]]
            corners = self.mesh.vertices[self.mesh.faces[face]]
            closest = trimesh.triangles.closest_point(corners, points[there])
            distance = np.linalg.norm(closest - points[there], axis=1)
            near = distance < best[there]
            there, face, closest, distance, corners = (each[near] for each in (there, face, closest, distance, corners))
            bary = np.clip(trimesh.triangles.points_to_barycentric(corners, closest), 0, 1)
            fits = self._agree(face, bary, normals[there], cosine)
            best[there[fits]], best_face[there[fits]], best_bary[there[fits]] = distance[fits], face[fits], bary[fits]
        return best_face, best_bary

    def _agree(self, face: np.ndarray, bary: np.ndarray, normals: np.ndarray, cosine: float) -> np.ndarray:
        own = interpolate(self.normals, self.mesh.faces, face, bary)
        return (face >= 0) & ((own * normals).sum(1) > cosine * np.linalg.norm(own, axis=1))


def _divided(corners: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut triangles [F, 3, 3] at the middles of edges longer than `longest`, until there are none.

    Returns the pieces' corners [N, 3, 3] and the triangle of each [N]. Pieces and order are those of trimesh's
    `subdivide_to_size`, which renumbers all edges in each pass and is several times slower.
    """
    parent = np.arange(len(corners))
    for done in range(MOST_CUTS + 1):
        following = corners[:, [1, 2, 0]]
        cut = ((corners - following) ** 2).sum(2) ** 0.5 > longest  # edges a-b, b-c and c-a
        if not cut.any():
            return corners, parent
        if done == MOST_CUTS:
            raise ValueError(f"edges longer than {longest} after {MOST_CUTS} cuts")
        middle, cuts = (corners + following) / 2, cut.sum(1)
        none, one, two, three = (np.flatnonzero(cuts == count) for count in range(4))
        # turned so that the edge that is cut is a-b
        turn, at = cut[one].argmax(1), np.arange(len(one))
        a, b, c = (corners[one, (turn + k) % 3] for k in range(3))
        p = middle[one][at, turn]
        halves = np.stack([a, p, c, p, b, c], 1).reshape(-1, 3, 3)
        # turned so that the edge that stays is c-a: the corner at b, and the rest parted along its shorter diagonal
        turn, at = (cut[two].argmin(1) + 1) % 3, np.arange(len(two))
        a, b, c = (corners[two, (turn + k) % 3] for k in range(3))
        p, q = middle[two][at, turn], middle[two][at, (turn + 1) % 3]
        by_aq = (((a - q) ** 2).sum(1) <= ((p - c) ** 2).sum(1))[:, None, None]
        thirds = np.concatenate(
            [
                np.stack([p, b, q], 1),
                np.where(by_aq, np.stack([a, p, q], 1), np.stack([a, p, c], 1)),
                np.where(by_aq, np.stack([a, q, c], 1), np.stack([p, q, c], 1)),
            ]
        )
        (a, b, c), (p, q, r) = corners[three].swapaxes(0, 1), middle[three].swapaxes(0, 1)
        fourths = np.stack([a, p, r, p, b, q, r, q, c, p, q, r], 1).reshape(-1, 3, 3)
        corners = np.concatenate([corners[none], halves, thirds, fourths])
        parent = np.concatenate(
            [parent[none], np.repeat(parent[one], 2), np.tile(parent[two], 3), np.repeat(parent[three], 4)]
        )


def welded(mesh: Mesh, tolerance: float = 1e-6) -> tuple[Mesh, np.ndarray]:
    """Sew open edges where exactly two lie at one place; returns the mesh and the new index of each old vertex.

    `tolerance` is a share of the mesh's size. Files often split a mesh along its UV seams, and the halves would come
    apart and be shaded apart. Surfaces that merely touch, as a film of tears and a lid, stay apart.
    """
    size = np.ptp(mesh.vertices, axis=0).max()
    _, place = np.unique(np.round(mesh.vertices / (tolerance * size)).astype(np.int64), axis=0, return_inverse=True)
    place = place.ravel()
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    swap = place[edges[:, 0]] > place[edges[:, 1]]
    # both ends sorted by place, so that partners' ends have one order
    edges = np.where(swap[:, None], edges[:, ::-1], edges)
    _, group, uses = np.unique(place[edges], axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    order = np.argsort(group, kind="stable")
    twos = order[(uses == 2)[group[order]]].reshape(-1, 2)
    pairs = np.concatenate([edges[twos, i] for i in range(2)])
    graph = sparse.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(place), len(place)))
    _, index = connected_components(graph, directed=False)
    _, first, index = np.unique(index, return_index=True, return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[first], faces=index[mesh.faces]), index


def tangents(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return unit tangents [F, 3, 3] per corner, along growing u, and handedness [F] (-1: mirrored in UV space).

    Averaged over the triangles that share a corner's vertex and UV, as MikkTSpace does (Mikkelsen 2008).
    """
    corners, uvs = mesh.vertices[mesh.faces], mesh.uvs[mesh.face_uvs]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d1, d2 = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
    double = d1[:, 0] * d2[:, 1] - d2[:, 0] * d1[:, 1]
    hand = np.where(double < 0, -1, 1)
    along = (e1 * d2[:, 1:] - e2 * d1[:, 1:]) * hand[:, None]
    key = np.column_stack([mesh.faces.ravel(), np.round(uvs.reshape(-1, 2) * 1e6).astype(np.int64), np.repeat(hand, 3)])
    _, group = np.unique(key, axis=0, return_inverse=True)
    group = group.ravel()
    total = np.zeros((group.max() + 1, 3))
    np.add.at(total, group, np.repeat(unit(along), 3, 0) * _angles(corners).reshape(-1, 1))
    normal = vertex_normals(mesh)[mesh.faces.ravel()]
    tangent = total[group]
    tangent -= (tangent * normal).sum(1, keepdims=True) * normal
    return unit(tangent).reshape(-1, 3, 3), hand


def frames(
    normals: np.ndarray, faces: np.ndarray, tangent: np.ndarray, hand: np.ndarray, face: np.ndarray, bary: np.ndarray
):
    """Return tangent, bitangent and normal [N, 3] at samples face, bary of a mesh: unit and orthogonal.

    normals [V, 3] are unit, faces [F, 3], tangent and hand from `tangents`.
    """
    n = unit((normals[faces[face]] * bary[..., None]).sum(1))
    t = (tangent[face] * bary[..., None]).sum(1)
    t = unit(t - (t * n).sum(1, keepdims=True) * n)
    return t, np.cross(n, t) * hand[face][:, None], n


def _angles(corners: np.ndarray) -> np.ndarray:
    """Angles [F, 3] in radians at the corners [F, 3, 3] of triangles."""
    angles = []
    for i in range(3):
        a, b = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        angles.append(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(1)))
    return np.stack(angles, 1)
