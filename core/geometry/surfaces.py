# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From one surface to another that lies on it: partners of points, and the tangent frames in which normal maps are
written.

A partner is where the ray along a point's normal meets the other surface, or else the nearest point of it, and only
where the two surfaces face the same way: the inside of a lip is no partner of the other lip.
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

CANDIDATE_COUNTS = (8, 64)
"""How many samples near a point are looked at: at first, and where none of these will do."""
NEAR_SHARE = 0.25
"""The first rays start this share of `farthest` off the surface: most partners lie within, and farther ones cost a
search."""
MOST_CUTS = 12
"""Passes in which edges are cut in two: those of a head of eight metres, and not of one in millimetres."""


class Surface:
    """A mesh on which partners are looked for. `spacing` in metres: how densely it is sampled for the search of nearest
    points."""

    def __init__(self, mesh: Mesh, spacing: float = 0.002):
        self.mesh, self.normals = mesh, vertex_normals(mesh)
        corners, self._parent = _divided(mesh.vertices[mesh.faces], spacing)
        self._tree = cKDTree(corners.mean(1))
        self._caster = RayCaster(mesh)

    def find_partners(
        self, points: np.ndarray, normals: np.ndarray, farthest: float, cosine: float = 0.3
    ) -> tuple[np.ndarray, np.ndarray]:
        """The partners of points on another surface.

        Parameters
        ----------
        points : [N, 3], in metres
        normals : [N, 3], unit
        farthest : metres within which a partner lies
        cosine : of the two normals' angle; below it they do not face the same way

        Returns
        -------
        Triangle int64 [N], -1 for no partner, and barycentric [N, 3].
        """
        lift = NEAR_SHARE * farthest
        face, bary, distance = self.cast_rays(points + lift * normals, -normals, normals, cosine)
        face = np.where(distance < 2 * lift, face, -1)
        missed = np.flatnonzero(face < 0)
        face[missed], bary[missed] = self.find_nearest(points[missed], normals[missed], farthest, cosine)
        return face, bary

    def cast_rays(
        self, origins: np.ndarray, directions: np.ndarray, normals: np.ndarray, cosine: float = 0.3
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """First hits of rays, without those where the surface does not face the way of `normals`.

        Parameters
        ----------
        origins : [N, 3], in metres
        directions : [N, 3], unit
        normals : [N, 3], unit
        cosine : as in `find_partners`

        Returns
        -------
        As RayCaster.first_hits; of what is left out only the triangle is -1.
        """
        face, bary, distance = self._caster.first_hits(origins, directions)
        return np.where(self._agree(face, bary, normals, cosine), face, -1), bary, distance

    def find_nearest(
        self, points: np.ndarray, normals: np.ndarray, farthest: float, cosine: float = 0.3
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `find_partners`, by distance alone.

        Parameters
        ----------
        points, normals, farthest, cosine : as in `find_partners`
        """
        face, bary = self._nearest_of(CANDIDATE_COUNTS[0], points, normals, farthest, cosine)
        missed = np.flatnonzero(face < 0)  # another sheet lies before the one that faces the same way
        face[missed], bary[missed] = self._nearest_of(
            CANDIDATE_COUNTS[1], points[missed], normals[missed], farthest, cosine
        )
        return face, bary

    def _nearest_of(self, count: int, points, normals, farthest: float, cosine: float) -> tuple[np.ndarray, np.ndarray]:
        """The best of the `count` samples nearest to each point."""
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
            there, face, closest, distance, corners = (
                there[near],
                face[near],
                closest[near],
                distance[near],
                corners[near],
            )
            bary = np.clip(trimesh.triangles.points_to_barycentric(corners, closest), 0, 1)
            fits = self._agree(face, bary, normals[there], cosine)
            best[there[fits]], best_face[there[fits]], best_bary[there[fits]] = distance[fits], face[fits], bary[fits]
        return best_face, best_bary

    def _agree(self, face: np.ndarray, bary: np.ndarray, normals: np.ndarray, cosine: float) -> np.ndarray:
        own = interpolate(self.normals, self.mesh.faces, face, bary)
        return (face >= 0) & ((own * normals).sum(1) > cosine * np.linalg.norm(own, axis=1))


def _divided(corners: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles [F, 3, 3] cut at the middles of their edges until none is longer than `longest`: their corners
    [N, 3, 3], and of which triangle each is a part [N].

    The pieces and their order are those of trimesh's `subdivide_to_size`, which numbers all edges anew in each pass and
    takes several times as long.
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
    """The mesh with its open edges sewn where two of them, and no third, lie at one place (within `tolerance` of its
    size), and for each of the old vertices the new one's index.

    Files often split a mesh along its UV seams; its halves would come apart, and be shaded apart. What merely touches,
    as a film of tears touches a lid, stays what it is.
    """
    size = np.ptp(mesh.vertices, axis=0).max()
    _, place = np.unique(np.round(mesh.vertices / (tolerance * size)).astype(np.int64), axis=0, return_inverse=True)
    place = place.ravel()
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    swap = place[edges[:, 0]] > place[edges[:, 1]]
    # both ends sorted by place, so that partners' ends stand in one order
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
    """Unit tangents [F, 3, 3] per triangle and corner, along growing u and across the vertex normal, and handedness [F]
    (-1: mirrored in UV space).

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
    np.add.at(
        total,
        group,
        np.repeat(along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-20), 3, 0)
        * _angles(corners).reshape(-1, 1),
    )
    normal = vertex_normals(mesh)[mesh.faces.ravel()]
    tangent = total[group]
    tangent -= (tangent * normal).sum(1, keepdims=True) * normal
    return (tangent / np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-20)).reshape(-1, 3, 3), hand


def frames(
    normals: np.ndarray, faces: np.ndarray, tangent: np.ndarray, hand: np.ndarray, face: np.ndarray, bary: np.ndarray
):
    """Tangent, bitangent and normal at samples of a mesh.

    Parameters
    ----------
    normals : [V, 3], unit
    faces : [F, 3]
    tangent, hand : from `tangents`
    face : [N], the triangle of each sample, all >= 0
    bary : [N, 3], where in it

    Returns
    -------
    [N, 3] each, unit and square to each other.
    """
    n = unit((normals[faces[face]] * bary[..., None]).sum(1))
    t = (tangent[face] * bary[..., None]).sum(1)
    t = unit(t - (t * n).sum(1, keepdims=True) * n)
    return t, np.cross(n, t) * hand[face][:, None], n


def _angles(corners: np.ndarray) -> np.ndarray:
    """Angles [F, 3] at the corners [F, 3, 3] of triangles, radians."""
    angles = []
    for i in range(3):
        a, b = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        angles.append(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(1)))
    return np.stack(angles, 1)
