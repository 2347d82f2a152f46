# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The neck ends in a plane, as a bust does: a fit leaves the template's open edge wavy, for no scan tells where a neck
ends."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.meshes import Mesh

REACH_WIDTH_SHARE = 0.2
"""Share of the edge's width over which the skin above it follows: 2 cm on a neck of 10."""
NEIGHBOURS = 6
"""Vertices of the edge whose shifts a vertex above it follows, the nearer the more."""


def level_edge(mesh: Mesh, vertices: np.ndarray) -> np.ndarray:
    """Vertices [V, 3] with the mesh's open edge in the plane that lies nearest to it; the skin above gives way less and
    less, the rest stays."""
    edge = open_edge(mesh)
    if not len(edge):
        return vertices
    border = vertices[edge]
    middle = border.mean(0)
    normal = np.linalg.svd(border - middle)[2][2]
    moves = -((border - middle) @ normal)[:, None] * normal
    reach = REACH_WIDTH_SHARE * 2 * float(np.linalg.norm(border - middle, axis=1).mean())
    distance, nearest = cKDTree(border).query(vertices, NEIGHBOURS, distance_upper_bound=reach)
    near = np.isfinite(distance[:, 0])
    weight = 1 / np.maximum(distance[near], 1e-4 * reach) ** 2
    spread = (moves[np.minimum(nearest[near], len(edge) - 1)] * weight[..., None]).sum(1) / weight.sum(1, keepdims=True)
    levelled = vertices.copy()
    levelled[near] += (1 - distance[near, :1] / reach) ** 2 * spread
    return levelled


def open_edge(mesh: Mesh) -> np.ndarray:
    """The vertices [N] of a mesh that lie on edges of one triangle only."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    return np.unique(edges[uses == 1])
