# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The likelihood of skin colours in two states of light, with outliers.

The expectation step of the fits of a light (sunlight.py) and of a shadow that stayed in a texture
(stages/shadow_mask/residual.py).
"""

from __future__ import annotations

import numpy as np

LUMINANCE_SIGMA_LOG = 0.2  # spread of skin about its tone, in natural log units: common to the three channels ...
CHROMA_SIGMA_LOG = 0.08  # ... and of the differences between channels
OUTLIER_SHARE = 0.05  # of points in neither state (hair, highlights, misregistration)
OUTLIER_RANGE_LOG = 3.0  # log units over which an outlier may lie, per channel


def log_likelihood(
    residual: np.ndarray, luminance_sigma: float = LUMINANCE_SIGMA_LOG, chroma_sigma: float = CHROMA_SIGMA_LOG
) -> np.ndarray:
    """Return the log density [...] of deviations [..., 3] (natural log units) from the expected colour of skin."""
    red, green, blue = (residual[..., k] for k in range(3))  # several times faster than a mean over an axis of three
    common = (red + green + blue) / 3
    chroma = (red - common) ** 2 + (green - common) ** 2 + (blue - common) ** 2
    return -0.5 * (3 * common**2 / luminance_sigma**2 + chroma / chroma_sigma**2) - np.log(
        luminance_sigma * chroma_sigma**2 * (2 * np.pi) ** 1.5
    )


def expect(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what the log densities [N] of two states, times their priors, say of each point.

    The share [N] of the first state among the two, the probability [N] of no outlier, and the log evidence [N].
    """
    outlier = np.log(OUTLIER_SHARE) - 3 * np.log(OUTLIER_RANGE_LOG)
    terms = np.stack([first, second, np.full(len(first), outlier)])  # [3, N]
    peak = terms.max(0)
    shares = np.exp(terms - peak)
    total = shares.sum(0)
    return shares[0] / np.maximum(shares[0] + shares[1], 1e-30), 1 - shares[2] / total, peak + np.log(total)
