# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Calibration of an uncertainty: likelihood of the errors against the best constant, and coverage of one sigma.

Errors and sigmas are differences of natural logarithms of albedo, or of anything else that both share; [N].
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Calibration:
    """Mean negative log-likelihood in nats, that of the best constant sigma, coverage of one sigma, and count."""

    likelihood: float
    constant: float
    coverage: float
    count: int

    @property
    def gained(self) -> float:
        return self.constant - self.likelihood


def negative_log_likelihood(error: np.ndarray, sigma: np.ndarray | float) -> float:
    """Return the mean of (e / s)^2 / 2 + log s + log(2 pi) / 2 over errors [N], in nats."""
    sigma = np.asarray(sigma, np.float64)
    if not (sigma > 0).all():
        raise ValueError("a standard deviation is positive")
    return float(np.mean((np.asarray(error, np.float64) / sigma) ** 2 / 2 + np.log(sigma)) + np.log(2 * np.pi) / 2)


def calibrate(error: np.ndarray, sigma: np.ndarray) -> Calibration:
    """Calibrate errors [N] and their sigmas [N]; the best constant is the root mean square error."""
    best = max(float(np.sqrt(np.mean(np.asarray(error, np.float64) ** 2))), 1e-12)
    return Calibration(
        negative_log_likelihood(error, sigma),
        negative_log_likelihood(error, best),
        float(np.mean(np.abs(error) <= sigma)),
        len(error),
    )
