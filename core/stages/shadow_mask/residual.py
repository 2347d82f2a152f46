# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows that are still in the texture: skin that is darker than lit skin should be, by the one colour that a shadow
has.

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
LIKELIEST_SHARE = 0.35


def find_shadow(
    colours: np.ndarray, normals: np.ndarray, skin: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear texture colours [N, 3], unit normals [N, 3], bool [N]: plain skin to fit on.

    Returns the log odds [N] that a texel is in shadow (-12 everywhere if there is none), its residual [N, 3] against
    lit skin in log units, and the shadow's colour [3] in log units (zeros: none).
    """
    log = np.log(np.maximum(colours, 1e-4))
    basis = smooth_basis(normals)
    drawn = np.flatnonzero(skin)
    drawn = drawn[:: max(1, len(drawn) // 6000)]
    none = (np.zeros(len(log)) - 12, log - np.median(log, 0), np.zeros(3))
    if len(drawn) < 200:
        return none
    plain = _expectation_maximisation(log[drawn], basis[drawn], np.zeros(3), iterations=15, fixed=True)
    fits = [
        _expectation_maximisation(log[drawn], basis[drawn], np.full(3, start), iterations=40)
        for start in FIRST_STEPS_LOG
    ]
    likelihood, smooth, step = max(fits, key=lambda fit: fit[0])
    if (
        step.mean() > -LEAST_STEP_LOG
        or step.max() > -0.05
        or likelihood - plain[0] < LEAST_LIKELIHOOD_GAIN * len(drawn)
    ):
        return none[0], log - basis @ plain[1], none[2]
    residual = log - basis @ smooth
    odds = _log_likelihood(residual - step) - _log_likelihood(residual)
    return np.clip(odds, -12, 12), residual, step


def _expectation_maximisation(log, basis, step, iterations, fixed=False):
    """-> (log likelihood, smooth [9, 3], step [3]) from a first guess of the step; `fixed` leaves it there with no
    texel in shadow."""
    count = len(log)
    dark = np.zeros(count) if fixed else (log.mean(1) < np.quantile(log.mean(1), 0.9) + 0.6 * step.mean()).astype(float)
    inlier, share = np.ones(count), 1e-6 if fixed else LIKELIEST_SHARE
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
    """The polynomials of the second-order spherical harmonics in unit normals [N, 3], centred: [N, 9], the first column
    1."""
    columns = np.stack(sh_polynomials(normals)[1:], 1)
    return np.concatenate([np.ones((len(columns), 1)), columns - columns.mean(0)], 1)
