# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Albedo error up to one light that all captures of a head share.

A soft light of the normals cannot be told from skin by one capture, and a scan's own map holds some: no answer is
blamed for it. What differs between the captures of one head is the light that was filmed, and stays an error.

The light is grey and of second order: log(answer / truth) = c . Y(n), nine numbers c. It is fitted in the logarithm,
where it is positive whatever c is, where an answer twice too bright counts like one twice too dark, and where the fit
is linear. Least squares with Huber's weights (Huber 1964), so that a shadow that was left in, which is local, does not
bend a light that is not.
"""

from dataclasses import dataclass

import numpy as np

from core.light.spherical_harmonics import sh_basis

DARKEST = 1e-3
"""Linear value under which a logarithm tells of noise."""
HUBER = 1.345
"""Residuals beyond so many deviations weigh less: 95 % as efficient as least squares on Gaussian ones."""
ROUNDS = 20
TO_DEVIATION = 1.4826
"""Median absolute deviation of a Gaussian -> its standard deviation."""


@dataclass(frozen=True)
class SharedLight:
    """Coefficients [9] of the orthonormal functions, and the deviation of the light's logarithm over its texels."""

    coefficients: np.ndarray
    deviation: float


def log_ratio(answer: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the grey log(answer / truth), the mean over channels; linear [..., 3] -> [...]."""
    return (np.log(np.maximum(answer, DARKEST)) - np.log(np.maximum(truth, DARKEST))).mean(-1)


def fit_light(ratios: list[np.ndarray], normals: list[np.ndarray]) -> SharedLight:
    """Fit one light to all captures, each of the same weight.

    Per capture: a grey log ratio [N_k], taken about its own median, since exposures are not the light's, and unit
    normals [N_k, 3] in axes of the head.
    """
    basis = np.concatenate([sh_basis(np.asarray(n, np.float64)) for n in normals])
    value = np.concatenate([np.asarray(r, np.float64) - np.median(r) for r in ratios])
    share = np.concatenate([np.full(len(r), 1 / len(r)) for r in ratios])
    weight, coefficients = share, np.zeros(9)
    for _ in range(ROUNDS):
        before, weighted = coefficients, basis * weight[:, None]
        coefficients = np.linalg.pinv(weighted.T @ basis, rcond=1e-10, hermitian=True) @ (weighted.T @ value)
        rest = np.abs(value - basis @ coefficients)
        scale = max(TO_DEVIATION * float(np.median(rest)), 1e-9)
        weight = share * np.minimum(1, HUBER * scale / np.maximum(rest, 1e-12))
        if np.abs(coefficients - before).max() < 1e-5:
            break
    light = basis @ coefficients
    middle = (share * light).sum() / share.sum()
    return SharedLight(coefficients, float(np.sqrt((share * (light - middle) ** 2).sum() / share.sum())))


def without_light(answer: np.ndarray, normals: np.ndarray, light: SharedLight) -> np.ndarray:
    """Return an answer, linear [N, 3], over the light at its normals [N, 3]."""
    return answer / np.exp(sh_basis(np.asarray(normals, np.float64)) @ light.coefficients)[:, None]
