# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes, teeth, sockets, lashes: parts of the artist's mesh with no counterpart on the scan go where the skin around
them goes.

The displacement of the skin is interpolated by a biharmonic radial basis function, which is linear far away and exact
at its centres (Carr et al. 2001); a ball stays a ball, so that an eye still turns in its socket.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from ...capture.messages import Reporter
from .alignment import similarity

MOST_CENTRES = 2000
"""Places that a field of shifts is interpolated from: its matrix of doubles is of that side, 32 MB."""
ROUND_RADIUS_SHARE = 0.06
"""Deviation from a sphere, as a share of its radius, below which a part is a ball."""


def carry_along(
    start: np.ndarray, label: np.ndarray, skin: np.ndarray, fitted: np.ndarray, report: Reporter
) -> np.ndarray:
    """The final vertices of a mesh whose skin was fitted: eyes, teeth and other parts go along.

    Parameters
    ----------
    start : [V, 3], in metres, all as placed by the similarity
    label : [V], the connected part that each belongs to
    skin : [S], indices of the fitted ones
    fitted : [S, 3], where they went
    report : hears of progress

    Returns
    -------
    [V, 3].
    """
    final = start.copy()
    final[skin] = fitted
    others = np.setdiff1d(np.arange(len(start)), skin)
    if not len(others):
        return final
    report.progress(0, 1, "carrying eyes, teeth and other parts along")
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
    """A displacement, smoothly continued from the places where it is known.

    Parameters
    ----------
    places : [N, 3]; of many an even choice counts
    shift : [N, 3], the displacement there
    at : [M, 3], where it is asked
    report : hears of progress

    Returns
    -------
    [M, 3].
    """
    chosen = np.linspace(0, len(places) - 1, min(len(places), MOST_CENTRES)).astype(int)
    # two centres at one place have no solution
    _, first = np.unique(np.round(places[chosen] * 1e5), axis=0, return_index=True)
    chosen = chosen[np.sort(first)]
    continued = RBFInterpolator(places[chosen], shift[chosen], kernel="linear", smoothing=1e-6)
    out = np.empty_like(at)
    for i in range(0, len(at), 4000):
        report.progress(i, len(at), "carrying eyes, teeth and other parts along")
        out[i : i + 4000] = continued(at[i : i + 4000])
    return out


def _centres(start: np.ndarray, skin: np.ndarray, other_parts: np.ndarray) -> np.ndarray:
    """Vertices of the skin that carry the rest: those nearest to the other parts, and an even choice of all."""
    distance, _ = cKDTree(start[other_parts]).query(start[skin])
    near = skin[np.argsort(distance, kind="stable")[: MOST_CENTRES // 2]]
    even = skin[np.linspace(0, len(skin) - 1, MOST_CENTRES // 2).astype(int)]
    return np.union1d(near, even)


def _is_ball(points: np.ndarray) -> bool:
    """Whether points lie on most of a sphere."""
    system = np.column_stack([2 * points, np.ones(len(points))])
    solution, *_ = np.linalg.lstsq(system, (points**2).sum(1), rcond=None)
    centre = solution[:3]
    distance = np.linalg.norm(points - centre, axis=1)
    radius = np.median(distance)
    return bool(np.std(distance) < ROUND_RADIUS_SHARE * radius and np.ptp(points, axis=0).min() > radius)
