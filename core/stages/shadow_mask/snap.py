# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The proposal laid on the edges that the texture as it was filmed shows: there the shadow has all of its contrast."""

from __future__ import annotations

import numpy as np

from ...light.shadow_edges import place
from .residual import smooth_basis


def snapped(
    mask: np.ndarray, filmed: np.ndarray, normals: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A mask laid on the shadow's edges.

    Parameters
    ----------
    mask : [S, S] in [0, 1]
    filmed : [S, S, 3], linear
    normals : [S, S, 3], unit
    weight : [S, S] in [0, 1], how far a texel tells of light

    Returns
    -------
    The mask, and how far [S, S] in [0, 1] each texel lies at an edge that was found.
    """
    edge = place(flattened(filmed, normals, mask, weight), mask, weight, 1024 / len(mask))
    return np.clip(edge.alpha, 0, 1), edge.on_edge


def flattened(filmed: np.ndarray, normals: np.ndarray, mask: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The texture over its smooth light; what the shadow under the mask takes is not told as smooth.

    Parameters
    ----------
    filmed : [S, S, 3], linear
    normals : [S, S, 3], unit
    mask : [S, S] in [0, 1]
    weight : [S, S] in [0, 1], how far a texel tells of light

    Returns
    -------
    [S, S, 3], about 1 where it is lit.
    """
    log = np.log(np.maximum(filmed, 2e-3))
    known = np.flatnonzero(weight.ravel() > 0.5)
    known = known[:: max(1, len(known) // 20000)]
    if len(known) < 100:
        return np.ones_like(filmed)
    basis = smooth_basis(normals.reshape(-1, 3))
    terms = np.concatenate([basis[known], mask.reshape(-1, 1)[known]], 1)
    ridge = np.diag([0.0, *[1e-3] * 8, 1e-3]) * len(known)
    fitted = np.linalg.solve(terms.T @ terms + ridge, terms.T @ log.reshape(-1, 3)[known])
    return np.exp(log - (basis @ fitted[:9]).reshape(log.shape)).astype(np.float32)
