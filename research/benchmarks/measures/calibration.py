# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether an uncertainty is one: log-likelihood of the errors under it, against the best that one number for all could
do, and coverage of one sigma.

Errors and sigmas are differences of natural logarithms of albedo, or of anything else that both share; [N].
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Calibration:
    """likelihood: mean negative log-likelihood in nats; constant: the same under the best constant sigma; gained: how
    much lower the first is; coverage: share of the errors within one sigma; count: how many there are."""

    likelihood: float
    constant: float
    coverage: float
    count: int

    @property
    def gained(self) -> float:
        return self.constant - self.likelihood


def negative_log_likelihood(error: np.ndarray, sigma: np.ndarray | float) -> float:
    """Mean of (e / s)^2 / 2 + log s + log(2 pi) / 2 over errors [N] of zero mean, in nats. Raises ValueError for a
    sigma that is not positive."""
    sigma = np.asarray(sigma, np.float64)
    if not (sigma > 0).all():
        raise ValueError("a standard deviation is positive")
    return float(np.mean((np.asarray(error, np.float64) / sigma) ** 2 / 2 + np.log(sigma)) + np.log(2 * np.pi) / 2)


def calibrate(error: np.ndarray, sigma: np.ndarray) -> Calibration:
    """Of errors [N] and their sigmas [N]. The best constant is the errors' root mean square."""
    best = max(float(np.sqrt(np.mean(np.asarray(error, np.float64) ** 2))), 1e-12)
    return Calibration(
        negative_log_likelihood(error, sigma),
        negative_log_likelihood(error, best),
        float(np.mean(np.abs(error) <= sigma)),
        len(error),
    )
