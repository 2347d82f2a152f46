# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a capture: a smooth environment (second-order spherical harmonics) and, if the skin shows one, a sun.

Skin of one tone is lit by the environment as far as the head itself leaves it visible (precomputed radiance transfer;
Sloan et al. 2002), and by the sun unless something on the head or off it blocks it. Which points the sun reaches is a
hidden variable of each point, and the light is fitted by expectation maximisation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .skylight import fibonacci_sphere
from .spherical_harmonics import UNIFORM

LUMINANCE_SIGMA_LOG = 0.2  # spread of skin about its tone, in natural log units: common to the three channels ...
CHROMA_SIGMA_LOG = 0.08  # ... and of the differences between channels
OUTLIER_SHARE = 0.05  # of points in neither state (hair, highlights, misregistration)
OUTLIER_RANGE_LOG = 3.0  # log units over which an outlier may lie, per channel
SKY_MEAN = np.array([0, 0, 0.41, 0, 0, 0, -0.11, 0, 0])
SKY_DEVIATION = np.array([0, 0.44, 0.29, 0.44, 0.40, 0.30, 0.40, 0.30, 0.40])
"""Environments without their sun or lamp: coefficients as shares of the first, mean and deviation of 35 panoramas
turned about the vertical (python -m research.benchmarks.light.skies)."""
# quadratic form [9, 9] of the prior in the coefficients of an environment of mean radiance one
_OFF_MEAN = np.eye(9)[1:] - np.outer(SKY_MEAN[1:], np.eye(9)[0])
_SKY_PRECISION = _OFF_MEAN.T @ np.diag((UNIFORM * SKY_DEVIATION[1:]) ** -2) @ _OFF_MEAN
INDEPENDENT_SAMPLES = 15
"""Of a face's bare skin, as deviations from its tone reach 16 mm (core/solver/extensions/split.py, python -m
research.benchmarks.light.skies)."""
MIN_SUN_GAIN = 0.15  # log likelihood per point required of a sun, or uneven skin passes for a shadow
DIRECTIONS_AROUND = 12  # tried about the best so far: six on each of two rings
FINER_DEG = (12.0, 4.0)  # radius of these rings, round by round
AMBIENT_FLOOR_SHARE = 0.15  # least environment shading, as a share of its median


@dataclass(frozen=True)
class Light:
    """An environment and a sun, both times the skin's tone: shading 1 is a surface of its colour under unit light.

    environment float64 [9, 3] holds orthonormal coefficients of radiance; sun is the unit direction [3] towards it,
    colour [3] its colour (zeros: no sun); floor [3] the least environment shading.
    """

    environment: np.ndarray
    sun: np.ndarray
    colour: np.ndarray
    floor: np.ndarray

    def ambient(self, transfer: np.ndarray) -> np.ndarray:
        """Return the linear colour [..., 3] of skin under the environment, from transfer [..., 9]."""
        return np.maximum(transfer @ self.environment, self.floor)

    def direct(self, normals: np.ndarray) -> np.ndarray:
        """Return what the unblocked sun adds [..., 3] at unit normals [..., 3]."""
        return np.maximum(normals @ self.sun, 0)[..., None] * self.colour

    @property
    def has_sun(self) -> bool:
        return bool(self.colour.max() > 0)


@dataclass(frozen=True)
class _SkinPoints:
    """Points of skin: linear colours [N, 3], their natural logarithm, transfer [N, 9] and weights [N]."""

    colours: np.ndarray
    log: np.ndarray
    transfer: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True)
class _Fit:
    """Log likelihood, environment [9, 3], sun colour [3], posteriors lit and inlier [N], and the skin's variance."""

    likelihood: float
    environment: np.ndarray
    sun: np.ndarray
    lit: np.ndarray
    inlier: np.ndarray
    spread: float


def fit_light(
    colours: np.ndarray,
    normals: np.ndarray,
    transfer: np.ndarray,
    reaches: Callable[[np.ndarray], np.ndarray],
    weights: np.ndarray,
    step: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[Light, np.ndarray, np.ndarray]:
    """Fit the light that explains linear colours [N, 3] of skin with unit normals [N, 3] and weights [N].

    transfer [N, 9] is the `radiance_transfer` of the points; `reaches` takes a direction [3] to [N] in [0, 1], whether
    the head itself lets light from there through; `step` hears (done, of) of all directions that are tried. Returns the
    light, the posterior [N] that the sun reaches a point, and the probability [N] that a point is no outlier.
    """
    skin = _SkinPoints(colours, np.log(np.maximum(colours, 1e-4)), transfer, weights)
    shade = np.zeros(len(colours))
    none = best = _expectation_maximisation(skin, shade, shade)
    best_direction = np.array([0.0, 0.0, 1.0])
    candidates = fibonacci_sphere(160)
    candidates = candidates[candidates[:, 2] > -0.3]  # lights stand above or beside a person
    done, of = 0, len(candidates) + len(FINER_DEG) * DIRECTIONS_AROUND
    for spread in (None, *FINER_DEG):
        if spread is not None:
            candidates = _around(best_direction, np.radians(spread))
        for direction in candidates:
            step(done, of)
            done += 1
            cosine = np.maximum(normals @ direction, 0)
            fit = _expectation_maximisation(skin, cosine, reaches(direction), best if spread else None)
            if fit.likelihood > best.likelihood:
                best, best_direction = fit, direction
    if best.likelihood - none.likelihood <= MIN_SUN_GAIN * weights.sum():
        best, best_direction = none, np.array([0.0, 0.0, 1.0])
    cosine, visible = (
        (shade, shade) if best is none else (np.maximum(normals @ best_direction, 0), reaches(best_direction))
    )
    best = _expectation_maximisation(skin, cosine, visible, best, iterations=30)
    floor = AMBIENT_FLOOR_SHARE * np.median(transfer @ best.environment, 0)
    return Light(best.environment, best_direction, best.sun, floor), best.lit, best.inlier


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


def _around(direction: np.ndarray, spread: float) -> np.ndarray:
    """Return DIRECTIONS_AROUND directions on two rings about one, the outer ring `spread` radians away."""
    side = np.cross(direction, [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    up = np.cross(direction, side)
    angles = np.arange(DIRECTIONS_AROUND // 2) * 4 * np.pi / DIRECTIONS_AROUND
    rings = [
        direction + np.tan(spread * r) * (np.cos(a) * side + np.sin(a) * up) for r in (0.5, 1.0) for a in angles + r
    ]
    return np.array([d / np.linalg.norm(d) for d in rings])


def _expectation_maximisation(
    skin: _SkinPoints, cosine: np.ndarray, visible: np.ndarray, start: _Fit | None = None, iterations: int = 12
) -> _Fit:
    """Fit environment and sun of one direction, beginning where `start` ended."""
    log, colours, transfer, weights = skin.log, skin.colours, skin.transfer, skin.weights
    prior = 0.03 + 0.67 * visible * (cosine > 0)  # that the sun reaches a point
    if start is None:
        # the sky gives the darker skin its colour, sky and sun the brightest
        luminance = log.mean(1)
        low, high = np.quantile(luminance, 0.3), np.quantile(luminance, 0.97)
        lit = visible * ((luminance - low) / max(high - low, 1e-3) > 0.5)
        inlier, spread = np.ones(len(colours)), LUMINANCE_SIGMA_LOG**2
    else:
        lit, inlier, spread = start.lit, start.inlier, start.spread
    scale = np.average(colours, axis=0, weights=weights)
    has_sun = bool(cosine.any())
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
        lit, inlier, evidence = expect(
            np.log(prior * (1 - OUTLIER_SHARE)) + log_likelihood(in_sun),
            np.log((1 - prior) * (1 - OUTLIER_SHARE)) + log_likelihood(in_shade),
        )
        spread = np.average(
            lit * (in_sun**2).mean(1) + (1 - lit) * (in_shade**2).mean(1), weights=inlier * weights + 1e-9
        )
    return _Fit(float((evidence * weights).sum()), environment, sun, lit, inlier, spread)


def _weighted_fit(transfer, cosine, colour, lit, weights, has_sun, spread) -> tuple[np.ndarray, float]:
    """Fit colour [N] ~ transfer @ e + lit * cosine * sun by relative least squares, each point once lit, once shaded.

    The higher bands have the prior of skies. It counts as INDEPENDENT_SAMPLES against the skin's variance `spread` (log
    units), however many points there are: freckled, flushed or bearded skin must not pass for light.
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
