# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts and folds of a fitted head, and their mending: the spot's displacement from the clean template is smoothed.

Two triangles cut where an edge of one pierces the other (Moeller and Trumbore 1997); neighbours along an edge are left
out.
"""

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from ...geometry.meshes import Mesh, face_normals

ROUNDS = 8  # maximum number of rounds, each of which smooths one more ring of neighbours


def mend(placed: Mesh, vertices: np.ndarray, tick=lambda done: None) -> np.ndarray:
    """Return vertices [V, 3] without flipped or intersecting triangles, as far as ROUNDS go; all others stay.

    `placed` is the template at rest, brought over the head by a similarity: it must be clean itself.
    """
    graph = _graph(placed)
    laplacian = sparse.diags(np.asarray(graph.sum(1)).ravel()) - graph
    laplacian = laplacian.tocsr()
    vertices = vertices.copy()
    for rings in range(1, ROUNDS + 1):
        tick(rings)
        folded = faulty_vertices(placed, vertices)
        if not folded.any():
            break
        free = folded
        for _ in range(rings):
            free = free | (graph @ free > 0)
        if free.all():
            break
        moved = vertices - placed.vertices
        movable, rest = np.flatnonzero(free), np.flatnonzero(~free)
        solved = spsolve(laplacian[movable][:, movable].tocsc(), -(laplacian[movable][:, rest] @ moved[rest]))
        moved[movable] = solved.reshape(-1, 3)
        vertices[movable] = placed.vertices[movable] + moved[movable]
    return vertices


def intersecting(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return pairs of triangles int64 [N, 2] that cut each other, the smaller index first."""
    corners = vertices[faces]
    centre = corners.mean(1)
    radius = np.linalg.norm(corners - centre[:, None], axis=-1).max(1)
    neighbours = cKDTree(centre).query_ball_point(centre, 2 * radius, workers=-1)
    larger = np.repeat(np.arange(len(faces)), [len(f) for f in neighbours])
    smaller = np.concatenate([np.asarray(f, np.int64) for f in neighbours])
    order = (radius[smaller] < radius[larger]) | ((radius[smaller] == radius[larger]) & (smaller < larger))
    larger, smaller = larger[order], smaller[order]
    low, high = corners.min(1), corners.max(1)
    near = ((low[larger] <= high[smaller]) & (low[smaller] <= high[larger])).all(1)
    larger, smaller = larger[near], smaller[near]
    apart = (faces[larger][:, :, None] == faces[smaller][:, None]).sum((1, 2)) < 2
    larger, smaller = larger[apart], smaller[apart]
    cut = _pierced(vertices, faces, larger, smaller) | _pierced(vertices, faces, smaller, larger)
    return np.sort(np.stack([larger[cut], smaller[cut]], 1), axis=1)


def flipped(before: Mesh, vertices: np.ndarray) -> np.ndarray:
    """Return the triangles that turned over between two shapes of one topology, bool [F]."""
    return (face_normals(before) * face_normals(before.moved(vertices))).sum(1) < 0


def faulty_vertices(placed: Mesh, vertices: np.ndarray) -> np.ndarray:
    """Return the corners of triangles that are flipped or cut another, bool [V]."""
    corners = np.zeros(len(vertices), bool)
    corners[placed.faces[np.unique(intersecting(vertices, placed.faces))]] = True
    corners[placed.faces[flipped(placed, vertices)]] = True
    return corners


def _pierced(vertices: np.ndarray, faces: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return True where an edge of triangle a[i], sharing no vertex with triangle b[i], pierces it, bool [N]."""
    p, q, r = (vertices[faces[b, k]] for k in range(3))
    along, down = q - p, r - p
    cut = np.zeros(len(a), bool)
    for k in range(3):
        first, second = faces[a, k], faces[a, (k + 1) % 3]
        own = (faces[b] != first[:, None]).all(1) & (faces[b] != second[:, None]).all(1)
        edge = vertices[second] - vertices[first]
        across = np.cross(edge, down)
        volume = (along * across).sum(1)
        inverse = 1 / np.where(np.abs(volume) > 1e-20, volume, np.inf)
        offset = vertices[first] - p
        turned = np.cross(offset, along)
        u, v, t = (offset * across).sum(1) * inverse, (edge * turned).sum(1) * inverse, (down * turned).sum(1) * inverse
        cut |= own & (np.abs(volume) > 1e-20) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
    return cut


def _graph(mesh: Mesh) -> sparse.csr_matrix:
    """Return the adjacency matrix [V, V] of the vertices."""
    a, b = mesh.faces[:, [0, 1, 2]].ravel(), mesh.faces[:, [1, 2, 0]].ravel()
    count = len(mesh.vertices)
    return (sparse.coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr() > 0).astype(
        np.float64
    )
