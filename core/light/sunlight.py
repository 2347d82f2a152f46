# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a capture: a smooth environment (second-order spherical harmonics) and, where the skin shows one, a sun.

Skin of one constant tone is lit by the environment as far as the head itself leaves it visible (precomputed radiance
transfer; Sloan et al. 2002) and by the sun unless something stands in the way, on the head or off it. Which points the
sun reaches is not known, so it is a hidden variable of each point and the light is fitted by expectation maximisation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .skylight import fibonacci_sphere
from .spherical_harmonics import UNIFORM

LUMINANCE_SIGMA_LOG = 0.2  # spread of skin about its tone, in log units: common to the three channels ...
CHROMA_SIGMA_LOG = 0.08  # ... and of the differences between channels
OUTLIER_SHARE = 0.05  # share of points that are neither (hair, highlights, misregistration)
OUTLIER_RANGE_LOG = 3.0  # log units over which an outlier may lie, per channel
SKY_MEAN = np.array([0, 0, 0.41, 0, 0, 0, -0.11, 0, 0])
SKY_DEVIATION = np.array([0, 0.44, 0.29, 0.44, 0.40, 0.30, 0.40, 0.30, 0.40])
"""What environments are like without their sun or lamp: coefficients as shares of the first, the mean and deviation of
35 panoramas turned about the vertical (python -m research.benchmarks.skies)."""
# The prior's quadratic form [9, 9] in the coefficients of an environment of mean radiance one
_OFF_MEAN = np.eye(9)[1:] - np.outer(SKY_MEAN[1:], np.eye(9)[0])
_SKY_PRECISION = _OFF_MEAN.T @ np.diag((UNIFORM * SKY_DEVIATION[1:]) ** -2) @ _OFF_MEAN
INDEPENDENT_SAMPLES = 15
"""A face's bare skin counts as so many samples of its tone, for deviations from it reach 16 mm
(core/solver/extensions/split.py,
python -m research.benchmarks.skies)."""
MIN_SUN_GAIN = 0.15  # log likelihood per point that a sun must be worth, or uneven skin passes for a shadow
DIRECTIONS_AROUND = 12  # that are tried about the best so far: six on each of two rings
FINER_DEG = (12.0, 4.0)  # how far about the best direction so far others are tried, one round after the other
AMBIENT_FLOOR_SHARE = 0.15  # the environment's shading never falls below this share of its median


@dataclass(frozen=True)
class Light:
    """environment float64 [9, 3]: coefficients (orthonormal) of radiance times skin tone; sun unit direction [3]
    towards it, its colour [3] (zeros: no sun).

    floor float64 [3] is the least environment shading. The tone is part of both: shading 1 would be a surface of the
    skin's own colour under unit light.
    """

    environment: np.ndarray
    sun: np.ndarray
    colour: np.ndarray
    floor: np.ndarray

    def ambient(self, transfer: np.ndarray) -> np.ndarray:
        """transfer [..., 9] -> linear colour of the skin under the environment [..., 3]."""
        return np.maximum(transfer @ self.environment, self.floor)

    def direct(self, normals: np.ndarray) -> np.ndarray:
        """unit normals [..., 3] -> what the unblocked sun adds [..., 3]."""
        return np.maximum(normals @ self.sun, 0)[..., None] * self.colour

    @property
    def has_sun(self) -> bool:
        return bool(self.colour.max() > 0)


@dataclass(frozen=True)
class _SkinPoints:
    """Points of skin: linear colours [N, 3] and their natural logarithm, transfer [N, 9] and weights [N]."""

    colours: np.ndarray
    log: np.ndarray
    transfer: np.ndarray
    weights: np.ndarray


def fit_light(
    colours: np.ndarray,
    normals: np.ndarray,
    transfer: np.ndarray,
    reaches: Callable[[np.ndarray], np.ndarray],
    weights: np.ndarray,
    step: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[Light, np.ndarray, np.ndarray]:
    """The light that explains the colours of skin.

    Parameters
    ----------
    colours : [N, 3], linear
    normals : [N, 3], unit
    transfer : [N, 9], `radiance_transfer` of the points
    reaches : direction [3] -> [N] in [0, 1], whether the head itself lets light from there through
    weights : [N]
    step : hears (done, of), of all directions that are tried

    Returns
    -------
    The light; the posterior [N] that the sun reaches a point; and that a point is explained at all (an inlier) [N].
    """
    skin = _SkinPoints(colours, np.log(np.maximum(colours, 1e-4)), transfer, weights)
    best = _expectation_maximisation(skin, np.zeros(len(colours)), np.zeros(len(colours)))
    none = best
    best_direction = np.array([0.0, 0.0, 1.0])
    candidates = fibonacci_sphere(160)
    candidates = candidates[candidates[:, 2] > -0.3]  # what shines on a person stands above or beside
    tried, of = 0, len(candidates) + len(FINER_DEG) * DIRECTIONS_AROUND
    for spread in (None, *FINER_DEG):
        if spread is not None:
            candidates = _around(best_direction, np.radians(spread))
        for direction in candidates:
            step(tried, of)
            tried += 1
            cosine = np.maximum(normals @ direction, 0)
            fitted = _expectation_maximisation(skin, cosine, reaches(direction), best[5] if spread else None)
            if fitted[0] > best[0]:
                best, best_direction = fitted, direction
    if best[0] - none[0] <= MIN_SUN_GAIN * weights.sum():
        best, best_direction = none, np.array([0.0, 0.0, 1.0])
    cosine, visible = (
        (np.maximum(normals @ best_direction, 0), reaches(best_direction))
        if best is not none
        else (np.zeros(len(colours)),) * 2
    )
    _, environment, sun, reached, inlier, _ = _expectation_maximisation(skin, cosine, visible, best[5], iterations=30)
    ambient = transfer @ environment
    return Light(environment, best_direction, sun, AMBIENT_FLOOR_SHARE * np.median(ambient, 0)), reached, inlier


def log_likelihood(residual: np.ndarray) -> np.ndarray:
    """Log density of a skin point's deviation [N, 3] (natural log units) from its expected colour."""
    red, green, blue = (residual[..., k] for k in range(3))  # a mean over an axis of three takes several times as long
    common = (red + green + blue) / 3
    chroma = (red - common) ** 2 + (green - common) ** 2 + (blue - common) ** 2
    return -0.5 * (3 * common**2 / LUMINANCE_SIGMA_LOG**2 + chroma / CHROMA_SIGMA_LOG**2) - np.log(
        LUMINANCE_SIGMA_LOG * CHROMA_SIGMA_LOG**2 * (2 * np.pi) ** 1.5
    )


def _around(direction: np.ndarray, spread: float) -> np.ndarray:
    """DIRECTIONS_AROUND directions on two rings about a direction, the outer one `spread` radians away."""
    side = np.cross(direction, [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    up = np.cross(direction, side)
    angles = np.arange(DIRECTIONS_AROUND // 2) * 4 * np.pi / DIRECTIONS_AROUND
    rings = [
        direction + np.tan(spread * r) * (np.cos(a) * side + np.sin(a) * up) for r in (0.5, 1.0) for a in angles + r
    ]
    return np.array([d / np.linalg.norm(d) for d in rings])


def _expectation_maximisation(
    skin: _SkinPoints, cosine: np.ndarray, visible: np.ndarray, start=None, iterations: int = 12
):
    """-> (log likelihood, environment [9, 3], sun colour [3], reached [N], inlier [N], responsibilities to start
    another fit from)."""
    log, colours, transfer, weights = skin.log, skin.colours, skin.transfer, skin.weights
    count = len(colours)
    prior = 0.03 + 0.67 * visible * (cosine > 0)  # that the sun reaches a point
    # a first guess of the two states: the sky gives the darker skin its colour, sky and sun the brightest
    low, high = np.quantile(log.mean(1), 0.3), np.quantile(log.mean(1), 0.97)
    bright = (log.mean(1) - low) / max(high - low, 1e-3)
    lit = visible * (bright > 0.5) if start is None else start[0]
    inlier = np.ones(count) if start is None else start[1]
    scale = np.average(colours, axis=0, weights=weights)
    has_sun = bool(cosine.any())
    spread = LUMINANCE_SIGMA_LOG**2 if start is None else start[2]
    for _ in range(iterations):
        environment, sun = np.zeros((9, 3)), np.zeros(3)
        for k in range(3):
            environment[:, k], sun[k] = _weighted_fit(
                transfer, cosine, colours[:, k] / scale[k], lit, inlier * weights, has_sun, spread
            )
        environment, sun = environment * scale, sun * scale
        ambient = transfer @ environment
        ambient = np.maximum(ambient, AMBIENT_FLOOR_SHARE * np.median(ambient, 0))
        in_shade = log - np.log(np.maximum(ambient, 1e-4))
        in_sun = log - np.log(np.maximum(ambient + cosine[:, None] * sun, 1e-4))
        shaded, sunlit = log_likelihood(in_shade), log_likelihood(in_sun)
        terms = np.stack(
            [
                np.log(prior * (1 - OUTLIER_SHARE)) + sunlit,
                np.log((1 - prior) * (1 - OUTLIER_SHARE)) + shaded,
                np.full(count, np.log(OUTLIER_SHARE) - 3 * np.log(OUTLIER_RANGE_LOG)),
            ]
        )  # [3, N]
        peak = terms.max(0)
        shares = np.exp(terms - peak)
        total = shares.sum(0)
        lit, inlier = shares[0] / np.maximum(shares[0] + shares[1], 1e-30), 1 - shares[2] / total
        spread = np.average(
            lit * (in_sun**2).mean(1) + (1 - lit) * (in_shade**2).mean(1), weights=inlier * weights + 1e-9
        )
    return float(((peak + np.log(total)) * weights).sum()), environment, sun, lit, inlier, (lit, inlier, spread)


def _weighted_fit(transfer, cosine, colour, lit, weights, has_sun, spread) -> tuple[np.ndarray, float]:
    """Relative least squares of colour [N] ~ transfer @ e + lit * cosine * sun, each point once as sunlit and once as
    shaded.

    The higher bands have the prior of skies. It counts as INDEPENDENT_SAMPLES tell of it, however many points there
    are, and as the `spread` of the skin about its tone, a variance in log units: freckled, flushed or bearded skin must
    not be told as light.
    """
    relative = 1 / np.maximum(colour, 0.1)
    a_lit = np.concatenate([transfer, cosine[:, None]], 1) * relative[:, None]
    a_shade = np.concatenate([transfer, np.zeros((len(colour), 1))], 1) * relative[:, None]
    target = colour * relative
    w1, w0 = weights * lit, weights * (1 - lit)
    normal = a_lit.T @ (a_lit * w1[:, None]) + a_shade.T @ (a_shade * w0[:, None])
    right = a_lit.T @ (target * w1) + a_shade.T @ (target * w0)
    ridge = np.zeros((10, 10))
    ridge[:9, :9] = _SKY_PRECISION * weights.sum() / INDEPENDENT_SAMPLES * spread
    if not has_sun:
        ridge[9, 9] = 1.0
    solution = np.linalg.solve(normal + ridge + 1e-9 * np.eye(10), right)
    if has_sun and solution[9] < 0:
        return np.linalg.solve((normal + ridge)[:9, :9], right[:9]), 0.0
    return solution[:9], float(solution[9]) if has_sun else 0.0
