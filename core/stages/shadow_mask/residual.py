# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows left in the texture: skin that is darker than lit skin should be, by the one colour that a shadow has.

log I_UV = smooth light over the normals + shadow colour * hidden 0 or 1 + skin's own variation. Fitted by expectation
maximisation; a shadow colour must be darker in every channel and must explain the texture clearly better than none.
"""

from __future__ import annotations

import numpy as np

from ...light.spherical_harmonics import sh_polynomials
from ...light.sunlight import OUTLIER_SHARE, expect, log_likelihood

LUMINANCE_SIGMA_LOG = 0.15  # spread of lit skin about its smooth expectation, natural log units ...
CHROMA_SIGMA_LOG = 0.06  # ... and of the differences between channels
LEAST_STEP_LOG = 0.3  # a shadow takes a quarter of the light or more; flushed noses and beards take less
LEAST_LIKELIHOOD_GAIN = 0.08  # of log likelihood per texel over a texture without shadow
FIRST_STEPS_LOG = (-0.4, -0.8, -1.3)  # darkenings that the fit starts from, natural log units
FIRST_SHARE = 0.35  # of skin in shadow, that the fit starts from


def find_shadow(colours: np.ndarray, normals: np.ndarray, skin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the log odds [N] that texels are in shadow and the shadow's log colour [3]; -12 and zeros if none.

    colours: linear [N, 3]; normals: unit [N, 3]; skin: bool [N], the plain skin to fit on.
    """
    none = np.full(len(colours), -12.0), np.zeros(3)
    log, basis = np.log(np.maximum(colours, 1e-4)), smooth_basis(normals)
    fit = np.flatnonzero(skin)
    fit = fit[:: max(1, len(fit) // 6000)]
    if len(fit) < 200:
        return none
    without, _, _ = _expectation_maximisation(log[fit], basis[fit], np.zeros(3), iterations=15, fixed=True)
    fits = [_expectation_maximisation(log[fit], basis[fit], np.full(3, first), 40) for first in FIRST_STEPS_LOG]
    likelihood, smooth, step = max(fits, key=lambda fit: fit[0])
    is_shadow = step.mean() <= -LEAST_STEP_LOG and step.max() <= -0.05
    if not is_shadow or likelihood - without < LEAST_LIKELIHOOD_GAIN * len(fit):
        return none
    residual = log - basis @ smooth
    return np.clip(_log_likelihood(residual - step) - _log_likelihood(residual), -12, 12), step


def _expectation_maximisation(log, basis, step, iterations, fixed=False):
    """Return (log likelihood, smooth [9, 3], step [3]) from a first step; `fixed` keeps it, with no texel in shadow."""
    count = len(log)
    dark = np.zeros(count) if fixed else (log.mean(1) < np.quantile(log.mean(1), 0.9) + 0.6 * step.mean()).astype(float)
    inlier, share = np.ones(count), 1e-6 if fixed else FIRST_SHARE
    ridge = np.diag([0.0, *[2e-3] * 3, *[2e-2] * 5]) * count
    for _ in range(iterations):
        weighted = basis * inlier[:, None]
        smooth = np.linalg.solve(
            weighted.T @ basis + ridge + 1e-9 * np.eye(9), weighted.T @ (log - dark[:, None] * step)
        )
        residual = log - basis @ smooth
        if not fixed:
            step = (residual * (dark * inlier)[:, None]).sum(0) / max((dark * inlier).sum(), 1e-6)
        shaded, inlier, evidence = expect(
            np.log(share) + np.log1p(-OUTLIER_SHARE) + _log_likelihood(residual - step),
            np.log1p(-share) + np.log1p(-OUTLIER_SHARE) + _log_likelihood(residual),
        )
        dark = np.zeros(count) if fixed else shaded
        share = share if fixed else float(np.clip((dark * inlier).sum() / max(inlier.sum(), 1e-6), 0.01, 0.9))
    return float(evidence.sum()), smooth, step


def _log_likelihood(residual: np.ndarray) -> np.ndarray:
    return log_likelihood(residual, LUMINANCE_SIGMA_LOG, CHROMA_SIGMA_LOG)


def smooth_basis(normals: np.ndarray) -> np.ndarray:
    """Return the second-order spherical-harmonic polynomials of normals [N, 3], centred: [N, 9], the first column 1."""
    columns = np.stack(sh_polynomials(normals)[1:], 1)
    return np.concatenate([np.ones((len(columns), 1)), columns - columns.mean(0)], 1)
