# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of the artist's mesh without a counterpart on the scan (eyes, teeth, sockets, lashes) follow the skin.

The displacement of the skin is interpolated by a biharmonic radial basis function, which is linear far away and exact
at its centres (Carr et al. 2001); a ball stays a ball, so that an eye still turns in its socket.
"""

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from ...capture.messages import Reporter
from .alignment import similarity

MOST_CENTRES = 2000  # maximum number of centres to interpolate from: the matrix of doubles has that side, 32 MB
ROUND_RADIUS_SHARE = 0.06  # deviation from a sphere, as a share of its radius, below which a part is a ball
CARRYING = "moving eyes, teeth and other parts with the skin"


def carry_along(
    start: np.ndarray, label: np.ndarray, skin: np.ndarray, fitted: np.ndarray, report: Reporter
) -> np.ndarray:
    """Return the vertices [V, 3] of a mesh whose skin [S] was fitted: all other parts follow.

    start [V, 3] is the mesh as placed by the similarity, label [V] its connected parts, skin the indices of the
    vertices that went to fitted [S, 3].
    """
    final = start.copy()
    final[skin] = fitted
    others = np.setdiff1d(np.arange(len(start)), skin)
    if not len(others):
        return final
    report.progress(0, 1, CARRYING)
    centres = _centres(start, skin, others)
    shift = np.zeros_like(start)
    shift[skin] = fitted - start[skin]
    final[others] += field(start[centres], shift[centres], start[others], report)
    for component in np.unique(label[others]):
        index = np.flatnonzero(label == component)
        if len(index) > 30 and _is_ball(start[index]):
            final[index] = similarity(start[index], final[index], np.ones(len(index))).apply(start[index])
    return final


def field(places: np.ndarray, shift: np.ndarray, at: np.ndarray, report: Reporter) -> np.ndarray:
    """Continue displacements [N, 3] known at places [N, 3] smoothly to `at` [M, 3]."""
    chosen = np.linspace(0, len(places) - 1, min(len(places), MOST_CENTRES)).astype(int)
    # two centres at one place have no solution
    _, first = np.unique(np.round(places[chosen] * 1e5), axis=0, return_index=True)
    chosen = chosen[np.sort(first)]
    continued = RBFInterpolator(places[chosen], shift[chosen], kernel="linear", smoothing=1e-6)
    out = np.empty_like(at)
    for i in range(0, len(at), 4000):
        report.progress(i, len(at), CARRYING)
        out[i : i + 4000] = continued(at[i : i + 4000])
    return out


def _centres(start: np.ndarray, skin: np.ndarray, other_parts: np.ndarray) -> np.ndarray:
    """Choose vertices of the skin to carry the rest: those nearest to the other parts, and an even choice of all."""
    distance, _ = cKDTree(start[other_parts]).query(start[skin])
    near = skin[np.argsort(distance, kind="stable")[: MOST_CENTRES // 2]]
    even = skin[np.linspace(0, len(skin) - 1, MOST_CENTRES // 2).astype(int)]
    return np.union1d(near, even)


def _is_ball(points: np.ndarray) -> bool:
    """Return True if points lie on most of a sphere."""
    system = np.column_stack([2 * points, np.ones(len(points))])
    solution, *_ = np.linalg.lstsq(system, (points**2).sum(1), rcond=None)
    centre = solution[:3]
    distance = np.linalg.norm(points - centre, axis=1)
    radius = np.median(distance)
    return bool(np.std(distance) < ROUND_RADIUS_SHARE * radius and np.ptp(points, axis=0).min() > radius)
