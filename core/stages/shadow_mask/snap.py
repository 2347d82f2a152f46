# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mask laid on the shadow edges of the filmed texture, where the shadow has all of its contrast."""

from __future__ import annotations

import numpy as np

from ...light.shadow_edges import place
from .residual import smooth_basis


def snap_to_edges(
    mask: np.ndarray, filmed: np.ndarray, normals: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a mask [S, S] in [0, 1] laid on the shadow's edges, and how surely [S, S] each texel lies at one.

    filmed: linear [S, S, 3]; normals: unit [S, S, 3]; weight [S, S] in [0, 1]: how well a texel shows the light.
    """
    edge = place(flatten_light(filmed, normals, mask, weight), mask, weight, 1024 / len(mask))
    return np.clip(edge.alpha, 0, 1), edge.on_edge


def flatten_light(filmed: np.ndarray, normals: np.ndarray, mask: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Divide a texture by its smooth light, [S, S, 3], about 1 where it is lit; the shadow under the mask stays."""
    log = np.log(np.maximum(filmed, 2e-3))
    fit = np.flatnonzero(weight.ravel() > 0.5)
    fit = fit[:: max(1, len(fit) // 20000)]
    if len(fit) < 100:
        return np.ones_like(filmed)
    basis = smooth_basis(normals.reshape(-1, 3))
    terms = np.concatenate([basis[fit], mask.reshape(-1, 1)[fit]], 1)
    ridge = np.diag([0.0, *[1e-3] * 9]) * len(fit)
    coefficients = np.linalg.solve(terms.T @ terms + ridge, terms.T @ log.reshape(-1, 3)[fit])
    return np.exp(log - (basis @ coefficients[:9]).reshape(log.shape)).astype(np.float32)
