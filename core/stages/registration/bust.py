# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Neck of a bust, ended in a plane and on a smooth outline.

A fit leaves the template's open edge wavy, for no scan shows where a neck ends, and the template's own edge has two
nicks.
"""

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.meshes import Mesh

REACH_WIDTH_SHARE = 0.2  # share of the edge's width over which the skin above it follows: 2 cm on a neck of 10
NEIGHBOURS = 6  # vertices of the edge that a vertex above it follows, the nearer the more
HARMONICS = 4  # harmonics of the outline's radius around the neck: it is an oval with a flat back
LEAST_STEP_SHARE = 0.3  # minimum angle between neighbours on the edge, as a share of the mean: it keeps their order


def level_edge(mesh: Mesh, vertices: np.ndarray) -> np.ndarray:
    """Return vertices [V, 3] with the mesh's open edge in its nearest plane and on a smooth outline.

    The skin above gives way less and less, the rest stays.
    """
    edge = open_edge(mesh)
    if not len(edge):
        return vertices
    border = vertices[edge]
    moves = _smooth(border) - border
    reach = REACH_WIDTH_SHARE * 2 * float(np.linalg.norm(border - border.mean(0), axis=1).mean())
    distance, nearest = cKDTree(border).query(vertices, NEIGHBOURS, distance_upper_bound=reach)
    near = np.isfinite(distance[:, 0])
    weight = 1 / np.maximum(distance[near], 1e-4 * reach) ** 2
    spread = (moves[np.minimum(nearest[near], len(edge) - 1)] * weight[..., None]).sum(1) / weight.sum(1, keepdims=True)
    levelled = vertices.copy()
    levelled[near] += (1 - distance[near, :1] / reach) ** 2 * spread
    levelled[edge] = border + moves
    return levelled


def open_edge(mesh: Mesh) -> np.ndarray:
    """Return the vertices [N] along the mesh's open edge, one after the other."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, uses = np.unique(np.sort(edges, 1), axis=0, return_index=True, return_counts=True)
    following = dict(edges[first[uses == 1]].tolist())  # as their triangles are wound
    loop = list(following)[:1]
    while loop and (after := following[loop[-1]]) != loop[0]:
        loop.append(after)
    return np.array(loop, int)


def _smooth(border: np.ndarray) -> np.ndarray:
    """Return a closed line [N, 3] in its nearest plane, its radius a few harmonics of the angle."""
    middle = border.mean(0)
    axes = np.linalg.svd(border - middle)[2]
    x, y = axes[:2] @ (border - middle).T
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    steps = np.angle(np.exp(1j * (np.roll(angle, -1) - angle)))
    way = np.sign(steps.sum())
    increments = np.maximum(way * steps, LEAST_STEP_SHARE * 2 * np.pi / len(border))
    increments *= 2 * np.pi / increments.sum()
    placed = way * np.append(0, np.cumsum(increments[:-1]))
    placed += np.angle(np.exp(1j * (angle - placed)).mean())
    waves = np.concatenate(
        [[np.ones(len(border))], *([np.cos(k * placed), np.sin(k * placed)] for k in range(1, HARMONICS + 1))]
    ).T
    length = np.linalg.norm(np.roll(border, -1, 0) - np.roll(border, 1, 0), axis=1)[:, None] ** 0.5
    smooth = waves @ np.linalg.lstsq(length * waves, length[:, 0] * radius, rcond=None)[0]
    return middle + (smooth * np.cos(placed))[:, None] * axes[0] + (smooth * np.sin(placed))[:, None] * axes[1]
